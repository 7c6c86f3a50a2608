// How rotary axes position: that part of storage/calibrations.h.
#pragma once

#include "storage/calibrations.h"

namespace sixpoint::storage {

absl::Status InsertAxis(Transaction& transaction, const std::string& calibration_id,
                        const AxisCharacterisationRow& axis);
// Without their tables, into the rows of these ids.
absl::Status ReadAxes(Transaction& transaction, const std::vector<std::string>& calibration_ids,
                      std::vector<CalibrationRow>* calibrations);
absl::Status ReadAxisTable(Transaction& transaction, const std::string& calibration_id, AxisCharacterisationRow* axis);

}  // namespace sixpoint::storage
