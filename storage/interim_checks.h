// Interim checks of sensor calibrations: what a study of that kind checked, and what they have said together.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "storage/database.h"

namespace sixpoint::storage {

struct InterimCheckRow {
  std::string sensor_calibration_id;
  std::string clamping;  // of its scans; empty: not stated
  Instant scanned_at;    // the first of its scans was received
  double limit_um = 0;   // 0: none was stated
};

// What the checks of a calibration that have a verdict say. One that was not accepted stands until one of later scans was, by a limit not
// greater.
struct InterimStateRow {
  std::string study_id, verdict;  // the newest that stands so; without one the newest
  // scanned_at of the newest that was accepted, by a limit not greater than theirs; none: none was.
  std::optional<Instant> stood_until;
};

// In the transaction of its study, after it.
absl::Status InsertInterimCheck(Transaction& transaction, const std::string& study_id, const InterimCheckRow& check);

// None: no check has judged it.
absl::StatusOr<std::optional<InterimStateRow>> InterimStateOf(Transaction& transaction,
                                                              const std::string& sensor_calibration_id);

}  // namespace sixpoint::storage
