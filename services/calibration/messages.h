// Recorded calibrations as messages.
#pragma once

#include <absl/status/statusor.h>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/calibration_store.h"

namespace sixpoint::calibration {

// With residuals and tables where the row was read with them. DATA_LOSS: a verdict that this release does not know.
absl::StatusOr<v1::Calibration> ToProto(const storage::CalibrationRow& row);

// The first thousand of what rests on it, and how many there are.
absl::StatusOr<v1::WithdrawCalibrationResponse> ToProto(const storage::WithdrawnCalibrationRow& row);

}  // namespace sixpoint::calibration
