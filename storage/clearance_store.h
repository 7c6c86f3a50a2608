// Clearances as they are granted, withdrawn and looked at, apart from where they are kept; what they let a reader see is
// storage/clearances.h's ClearanceReader. PostgreSQL's and the tests' fake pass the same suite
// (tests/storage/clearance_store_test.cc). Thread-safe. No call holds a connection after it returned.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "storage/clearances.h"
#include "storage/one_write.h"

namespace sixpoint::storage {

class ClearanceListReader {
 public:
  virtual ~ClearanceListReader() = default;
  // As ListClearances.
  virtual absl::StatusOr<std::vector<ClearanceRow>> List(const ClearanceFilter& filter, std::int64_t before_sequence,
                                                         int limit, Deadline deadline) const = 0;
};

// As the functions of storage/clearances.h, each all or nothing. A request_id that comes again changes nothing, and is answered with
// what stands by then; INVALID_ARGUMENT where it is no UUID.
class ClearanceStore : public ClearanceListReader {
 public:
  virtual absl::StatusOr<ClearanceRow> Grant(const ClearanceOrder& order, const StillWanted& still_wanted,
                                             Deadline deadline) = 0;
  // None: there never was one. That keeps no request_id.
  virtual absl::StatusOr<std::optional<ClearanceRow>> Withdraw(const ClearanceOrder& order,
                                                               const StillWanted& still_wanted, Deadline deadline) = 0;
};

// In PostgreSQL; the database lives longer.
std::shared_ptr<ClearanceStore> ClearanceStoreIn(Database* database);

}  // namespace sixpoint::storage
