// Release and withdrawal of calibrations (ADR 14): who decides what, and whether it may be decided.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/calibration_store.h"

namespace sixpoint::calibration {

// Of requests that CheckRequest let pass. The decision's check refuses a calibration that is not recorded, is withdrawn, or, to be
// released, is no draft or no longer valid.
absl::StatusOr<storage::CalibrationDecision> Decide(const v1::ReleaseCalibrationRequest& request,
                                                    const std::string& requested_by);
absl::StatusOr<storage::CalibrationDecision> Decide(const v1::WithdrawCalibrationRequest& request,
                                                    const std::string& requested_by);

// CALIBRATION_NOT_FOUND.
absl::Status NotRecorded(const std::string& name);

}  // namespace sixpoint::calibration
