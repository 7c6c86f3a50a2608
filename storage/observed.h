// The few figures of the record that whoever watches the plant wants, each asked for in milliseconds however long the record is (the calibrations: some 2 ms a thousand that were ever made).
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

// The journal's newest sequence; 0: nothing is recorded.
absl::StatusOr<std::int64_t> RecordHead(Transaction& transaction);
// How many months in a row after this one every table kept by months has, at most 12; -1 where one lacks this month. None: no table is kept so.
absl::StatusOr<std::optional<int>> MonthsAhead(Transaction& transaction);
// Blobs that were found damaged, each once, however often and whatever for.
absl::StatusOr<std::int64_t> CountDamages(Transaction& transaction);

struct CalibrationAge {
  std::string machine_id, kind, axis;  // axis: of the kind axis alone
  double age_s = 0;                    // since it became valid
  std::optional<double> left_s;        // until it ends, below 0 after it; none: it has no end
};
// Of each machine, kind and axis the one in force; where none is, the one that ended last, unless that is more than 30 days ago and
// the machine has scanned nothing since: it is gone. At most `limit`, by machine.
absl::StatusOr<std::vector<CalibrationAge>> CalibrationAges(Transaction& transaction, int limit);

}  // namespace sixpoint::storage
