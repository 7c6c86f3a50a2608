// The machining poses and hole starts of a blade as it really stands, with their uncertainties
// (docs/methods/correction.md).
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "metrology/correction/orientation.h"
#include "metrology/correction/registered_pose.h"
#include "metrology/frames/pose.h"
#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::metrology {

struct NominalHole {
  std::string name;
  Eigen::Vector3d start_in_part_mm = Eigen::Vector3d::Zero();
};
struct NominalHoleGroup {
  std::string name;
  Eigen::Vector3d axis_in_part = Eigen::Vector3d::UnitZ();  // unit, out of the part
  RotaryAngles nominal;
  std::vector<NominalHole> holes;
  double position_tolerance_mm = 0;  // of a start, as a distance
  double inclination_tolerance_rad = 0;
};

struct CorrectedHole {
  std::string name;
  Eigen::Vector3d start_mm = Eigen::Vector3d::Zero();          // machine, at the corrected angles
  Eigen::Vector3d nominal_start_mm = Eigen::Vector3d::Zero();  // machine, nominal part at the nominal angles
  Eigen::Matrix3d covariance_mm2 = NotYet<Eigen::Matrix3d>();  // of start_mm
  double expanded_uncertainty_um = 0;                          // 95 % of the distances to the true start lie below
  // The budget: of the distance's mean square, in um^2. Its greatest first; what is nothing is left out.
  std::vector<UncertaintyComponent> components;
  double degrees_of_freedom =
      std::numeric_limits<double>::infinity();  // of all together; the expanded uncertainty is widened for them
};
struct CorrectedHoleGroup {
  std::string name;
  RotaryAngles corrected;  // commands, on the identified axes
  RotaryAngles reached;    // by those commands: the same where no table is applied
  RotaryAngles nominal;
  double tilt_rad = 0;                       // of the direction from machine Z at these angles (orientation.h)
  double tilt_standard_uncertainty_rad = 0;  // beside what turns the axes, which follow: 0 where the tilt is
  RotaryAngles ideal;                        // on the machine's nominal axes: the paper's closed form
  double a_standard_uncertainty_rad = 0;     // of what is reached, beside what should be
  double b_standard_uncertainty_rad = 0;
  std::vector<CorrectedHole> holes;
};

// What drilling adds, beside the pose and the axes.
struct Drilling {
  // How many times as long as at 20 C the part is on the machine's scales; the pose is at 20 C.
  double stretch = 1;
  // Standard uncertainty, along each machine axis, of where the tool's tip stands against what the touch probe finds; and its name.
  double tool_offset_mm = 0;
  std::string tool_offset_name = "touch probe to tool";
};

// First-order propagation of the whole chain start(pose, axes, a(pose, axes), b(pose, axes)): an axis parameter moves the
// pose (as its source does) and turns the point again, so both are added before squaring. Both starts are on the
// identified axes: their difference shows the blade, not the machine. Where the pose was registered with tables, the angles
// are commanded so that by the same tables the true ones are reached; what the tables leave uncertain of the scans' angles
// and of these is added as independent of each other. Statuses as Orient's, naming the group.
absl::StatusOr<CorrectedHoleGroup> CorrectGroup(const NominalHoleGroup& group, const RegisteredPose& pose,
                                                const Eigen::Isometry3d& zero_from_part_nominal, const RotaryAxes& axes,
                                                const RotaryAxes& nominal_axes, const RotaryLimits& limits,
                                                const Drilling& drilling = {});

}  // namespace sixpoint::metrology
