// What grows with every blade is kept by months (migrations/V0009): a partition a month of each such table, made ahead of time.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

// So many are there beforehand: a plant whose service that makes them is away goes on recording for as long.
inline constexpr int kMonthsAhead = 3;
// More are refused.
inline constexpr int kMostMonthsAhead = 120;
// After so many a retry of a request is a new one.
inline constexpr int kRequestMonths = 3;

// One month of every table together.
struct MonthUse {
  std::string month;  // "2026-11"
  int partition_count = 0;
  std::int64_t row_count = 0;  // as the database last estimated
  std::int64_t bytes = 0;      // with indices, without blobs
};

// This month's partitions and those of so many months ahead, where they are not there yet; how many it made. A month is a
// transaction of its own, so that writers, who wait for it, wait for one month at most. INVALID_ARGUMENT: more than 120.
// UNAVAILABLE: something holds a table for longer than 2 s; later.
absl::StatusOr<int> MakeMonths(Database& database, int months_ahead, Deadline deadline);
// Takes away what requests recorded (not what it was) in months that ended so long ago; how many partitions.
absl::StatusOr<int> ForgetRequests(Transaction& transaction);
// The oldest first.
absl::StatusOr<std::vector<MonthUse>> ListMonths(Transaction& transaction);

}  // namespace sixpoint::storage
