// Angle tables of a machine's axes, from their characterisations.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/calibration/rotation_calibration.h"
#include "storage/database.h"

namespace sixpoint::calibration {

// Gives both joints the tables of their characterisations in force; returns the names of those. FAILED_PRECONDITION
// (reason AXIS_NOT_CHARACTERISED) where neither has one.
absl::StatusOr<std::vector<std::string>> AddAxisTables(storage::Transaction& transaction, const std::string& machine_id,
                                                       metrology::RotationOptions* options);

}  // namespace sixpoint::calibration
