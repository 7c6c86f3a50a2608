#include "metrology/efficacy/outcome.h"

namespace sixpoint::metrology {

SeenOutcome See(const HoleOutcome& outcome, const RotaryAxes& axes) {
  SeenOutcome seen;
  const Eigen::Matrix3d machine_from_part =
      axes.MachineFromZero(outcome.a_rad, outcome.b_rad).linear() * outcome.zero_from_part.linear();
  seen.part_from_machine = machine_from_part.transpose();
  seen.along = machine_from_part * outcome.predicted_axis;
  seen.across = Eigen::Matrix3d::Identity() - seen.along * seen.along.transpose();
  seen.position_mm = seen.across * machine_from_part * (outcome.found_start_mm - outcome.predicted_start_mm);
  seen.direction_rad = seen.across * machine_from_part * outcome.found_axis;
  // The tool stays where it is while the part turns too far: on the part the hole moves the other way.
  const Eigen::Vector3d start_in_zero = outcome.zero_from_part * outcome.predicted_start_mm;
  const Eigen::Vector3d beyond = start_in_zero + outcome.zero_from_part.linear() * outcome.predicted_axis;
  const auto at_start = axes.AngleJacobian(start_in_zero, outcome.a_rad, outcome.b_rad);
  seen.position_by_angles = -seen.across * at_start;
  seen.direction_by_angles = -seen.across * (axes.AngleJacobian(beyond, outcome.a_rad, outcome.b_rad) - at_start);
  return seen;
}

}  // namespace sixpoint::metrology
