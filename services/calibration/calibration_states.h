// Release and withdrawal of calibrations (ADR 14).
#pragma once

#include <absl/status/statusor.h>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/database.h"

namespace sixpoint::calibration {

// The same request_id again gives the same answer.
absl::StatusOr<v1::Calibration> Release(storage::Database* database, storage::Deadline deadline,
                                        const v1::ReleaseCalibrationRequest& request);
absl::StatusOr<v1::WithdrawCalibrationResponse> Withdraw(storage::Database* database, storage::Deadline deadline,
                                                         const v1::WithdrawCalibrationRequest& request);

}  // namespace sixpoint::calibration
