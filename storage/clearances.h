// Who is cleared to see what of which part (V0018): granted, withdrawn, and asked about.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/reader.h"

namespace sixpoint::storage {

struct ClearanceRow {
  std::string holder;  // users/jane
  std::string scope;   // customers/acme, parts/blade-7
  std::int64_t granted_sequence = 0;
  Instant granted_at;
  std::string granted_by;
  std::optional<Instant> withdrawn_at;
  std::string withdrawn_by;  // empty: it holds
};

struct ClearanceOrder {
  std::string holder, scope, requested_by;
  std::string request_id;  // a UUID
};

// In a transaction of the caller's. What holds already is answered as it stands, and its request_id kept. ALREADY_EXISTS: the request_id was another's.
absl::StatusOr<ClearanceRow> GrantClearance(Transaction& transaction, const ClearanceOrder& order);
// What is withdrawn already is answered as it stands; none: there never was one.
absl::StatusOr<std::optional<ClearanceRow>> WithdrawClearance(Transaction& transaction, const ClearanceOrder& order);

// What is empty matches all.
struct ClearanceFilter {
  std::string holder, scope;
  bool withdrawn_too = false;
};
// Granted last first, from below `before_sequence` (0: from the newest).
absl::StatusOr<std::vector<ClearanceRow>> ListClearances(Transaction& transaction, const ClearanceFilter& filter,
                                                         std::int64_t before_sequence, int limit);

// What a list leaves out. hidden_parts is empty for whom nothing is hidden from.
struct Sight {
  std::vector<std::string> hidden_parts;
  std::optional<std::vector<std::string>>
      seen_blades;  // where something is hidden and these are few: all that are seen
};
// Two arrays: hidden parts and, or else NULL, the blades that are seen, which say it alone: PostgreSQL would take both for rarer
// than either, and read whole months to find them.
void AddSight(const Sight& sight, Params* params);
absl::StatusOr<Sight> SightOf(Transaction& transaction, const Reader& reader);

enum class Unrecorded { kIsHidden, kIsSeen };  // for whom something is hidden from
// The first of the names that the reader may not see.
absl::StatusOr<std::optional<std::string>> FirstHidden(Transaction& transaction, const Reader& reader,
                                                       const std::vector<std::string>& names, Unrecorded unrecorded);
// OK where the reader may make a part of that id and customer (empty: as it was); else PERMISSION_DENIED (CLEARANCE_MISSING). Who gives
// a part to a customer is cleared for that customer and for the one it had: whose part it is says who sees all that is of it.
absl::Status CheckPartSeen(Transaction& transaction, const Reader& reader, const std::string& part_id,
                           const std::string& customer_id);
// PERMISSION_DENIED (CLEARANCE_MISSING), the same for what is hidden and what is not recorded.
absl::Status NotSeen(const std::string& field, const std::string& name, const Reader& reader);

class ClearanceReader {
 public:
  virtual ~ClearanceReader() = default;
  // As the function of this name.
  virtual absl::StatusOr<std::optional<std::string>> FirstHidden(const Reader& reader,
                                                                 const std::vector<std::string>& names,
                                                                 Unrecorded unrecorded, Deadline deadline) const = 0;
};
// In PostgreSQL; the database lives longer.
std::shared_ptr<const ClearanceReader> ClearancesIn(Database* database);

}  // namespace sixpoint::storage
