// What a person decided about an inspected blade, beside the verdict: rows that are appended, of which the newest holds.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/record.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

struct DispositionRow {
  std::string disposition_id;
  std::string inspection_id;
  std::string blade_serial;  // the inspection's, as is machine_id
  std::string machine_id;    // not read back
  std::string disposition;   // CONCESSION, REWORK, SCRAP, USE_AS_IS, RETURN
  std::string reason;
  std::string reference;  // empty: none
  std::string requested_by, software_version;
  Recorded recorded;
};

// In PostgreSQL; the database lives longer.
std::shared_ptr<ResultWriter<DispositionRow>> DispositionsIn(Database* database);

// Call it last before the commit (the journal's lock).
absl::StatusOr<DispositionRow> InsertDisposition(Transaction& transaction, DispositionRow row,
                                                 const RecordEntry& entry);
// Of these inspections, the newest first.
absl::StatusOr<std::vector<DispositionRow>> DispositionsOf(Transaction& transaction,
                                                           const std::vector<std::string>& inspection_ids);

}  // namespace sixpoint::storage
