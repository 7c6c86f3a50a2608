// Recorded calibrations as messages.
#pragma once

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/calibration_store.h"

namespace sixpoint::calibration {

// With residuals and tables where the row was read with them.
v1::Calibration ToProto(const storage::CalibrationRow& row);

// The first thousand of what rests on it, and how many there are.
v1::WithdrawCalibrationResponse WithdrawalOf(const storage::WithdrawnCalibrationRow& row);

}  // namespace sixpoint::calibration
