// What a hole as it was cut says of the machine that cut it (docs/methods/efficacy.md).
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::metrology {

// One hole: where the correction was to put it, and where the inspection found it. Both in the part's frame, where the correction's goal is
// the drawing's own place; zero_from_part and the angles are those that it was cut by.
struct HoleOutcome {
  std::string hole;  // "G1/H3"
  double a_rad = 0, b_rad = 0;
  Eigen::Isometry3d zero_from_part = NotYet<Eigen::Isometry3d>();
  Eigen::Vector3d predicted_start_mm = Eigen::Vector3d::Zero(), predicted_axis = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d found_start_mm = Eigen::Vector3d::Zero(), found_axis = Eigen::Vector3d::UnitZ();
  // Of the inspection: root mean square distance and angle.
  double position_standard_uncertainty_mm = 0, inclination_standard_uncertainty_rad = 0;
  // Of those variances, what is off the same way on every blade: 0 to 1.
  double shared_part = 0;
};

// The same in the machine's frame, at the cut. What lies along the hole is not seen: a pin tells an axis, and where along it the surface
// is pierced is the surface's doing. So everything is projected across the hole.
struct SeenOutcome {
  Eigen::Vector3d along = Eigen::Vector3d::UnitZ();  // the hole's direction
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();  // the projector
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero(), direction_rad = Eigen::Vector3d::Zero();
  // Change of both by what the rotary axes really stand beyond their commands (3 x 2, of a and b).
  Eigen::Matrix<double, 3, 2> position_by_angles = Eigen::Matrix<double, 3, 2>::Zero();
  Eigen::Matrix<double, 3, 2> direction_by_angles = Eigen::Matrix<double, 3, 2>::Zero();
  Eigen::Matrix3d part_from_machine = Eigen::Matrix3d::Identity();
};

SeenOutcome See(const HoleOutcome& outcome, const RotaryAxes& axes);

}  // namespace sixpoint::metrology
