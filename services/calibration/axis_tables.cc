#include "services/calibration/axis_tables.h"

#include <chrono>

#include "services/calibration/axis_messages.h"
#include "services/runtime/errors.h"
#include "storage/calibrations.h"

namespace sixpoint::calibration {

absl::StatusOr<std::vector<std::string>> AddAxisTables(const storage::CalibrationReader& calibrations,
                                                       const std::string& machine_id, storage::Deadline deadline,
                                                       metrology::RotationOptions* options) {
  const storage::Instant now = std::chrono::system_clock::now();
  std::vector<std::string> used;
  for (metrology::RotaryJoint& joint : options->joints) {
    const auto in_force = calibrations.InForce({machine_id, "axis", joint.axis}, now, deadline);
    if (!in_force.ok()) return in_force.status();
    if (!in_force->has_value()) continue;
    joint.table = TableOf(*(**in_force).axis);
    used.push_back((**in_force).name());
  }
  if (used.empty())
    return runtime::Failure(errors::v1::AXIS_NOT_CHARACTERISED,
                            "machines/" + machine_id + ": neither " + options->joints[0].axis + " nor " +
                                options->joints[1].axis +
                                " has a characterisation in force, want one of either; run `calibrate axis` first",
                            {{"resource", "machines/" + machine_id}});
  return used;
}

}  // namespace sixpoint::calibration
