// Angle tables of a machine's axes, from their characterisations.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/calibration/rotation_calibration.h"
#include "storage/calibration_store.h"

namespace sixpoint::calibration {

// Gives both joints the tables of their characterisations in force; returns the names of those. FAILED_PRECONDITION
// (reason AXIS_NOT_CHARACTERISED) where neither has one.
absl::StatusOr<std::vector<std::string>> AddAxisTables(const storage::CalibrationReader& calibrations,
                                                       const std::string& machine_id, storage::Deadline deadline,
                                                       metrology::RotationOptions* options);

}  // namespace sixpoint::calibration
