// Release and withdrawal of calibrations (ADR 14).
#pragma once

#include <absl/status/statusor.h>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/calibration_store.h"

namespace sixpoint::calibration {

// The same request_id again gives the same answer.
absl::StatusOr<v1::Calibration> Release(storage::CalibrationWriter& store, storage::Deadline deadline,
                                        const v1::ReleaseCalibrationRequest& request);
absl::StatusOr<v1::WithdrawCalibrationResponse> Withdraw(storage::CalibrationWriter& store, storage::Deadline deadline,
                                                         const v1::WithdrawCalibrationRequest& request);

}  // namespace sixpoint::calibration
