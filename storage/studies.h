// Studies of what an instrument or a procedure can do.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/interim_checks.h"
#include "storage/reader.h"
#include "storage/record.h"
#include "storage/result_store.h"
#include "storage/time_span.h"

namespace sixpoint::storage {

struct StudyRow {
  std::string study_id;    // UUID
  std::string machine_id;  // empty where it concerns none
  std::string kind;        // GAUGE, ARM, REPEAT, GAUGE_RR, SPHERE_CHECK, INTERIM_CHECK
  std::vector<std::string> inputs;
  std::string request_bytes;  // as it was sent; kept as a blob, not read back
  std::string verdict;        // ACCEPTED, REJECTED, UNDECIDABLE, REPORTED
  std::string result_json;
  std::optional<double> temperature_c;
  std::string requested_by;
  std::string software_version;
  std::optional<InterimCheckRow> interim_check;  // of that kind; not read back
  Recorded recorded;                             // set by InsertStudy
};

// What is empty matches all.
struct StudyFilter {
  std::string machine_id;
  std::string kind;
  std::string verdict;
  TimeSpan recorded;
  std::string sensor_calibration_id, clamping;  // of interim checks
  Reader reader;                                // what he may not see is not listed
};

using StudyStore = ResultStore<StudyRow, StudyFilter>;
// In PostgreSQL; the database lives longer.
std::shared_ptr<StudyStore> StudiesIn(Database* database);

// The same in a transaction of the caller's.
// The request as a blob, journal entry and study. Call it last before the commit (the journal's lock).
absl::StatusOr<Recorded> InsertStudy(Transaction& transaction, const StudyRow& study, const RecordEntry& entry);

absl::StatusOr<std::optional<StudyRow>> FindStudy(Transaction& transaction, const std::string& study_id);

// Newest first, from below `before_sequence` (0: from the newest).
absl::StatusOr<std::vector<StudyRow>> ListStudies(Transaction& transaction, const StudyFilter& filter,
                                                  std::int64_t before_sequence, int limit);

}  // namespace sixpoint::storage
