// A line that an axis turns about or moves along, its small changes, and their effect on a point.
#pragma once

#include <Eigen/Geometry>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

struct AxisLine {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // unit
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
};

// Two fixed unit vectors e1, e2 across a direction: a line's direction is perturbed along (e1, e2) and its point too.
Eigen::Matrix<double, 3, 2> TangentBasis(const Eigen::Vector3d& direction);

// Rotation by angle_rad about the line.
Eigen::Isometry3d AboutLine(const AxisLine& axis, double angle_rad);

// The line with its direction turned towards e1, e2 by w(0), w(1) (rad) and its point shifted by w(2), w(3) (mm).
AxisLine PerturbedLine(const AxisLine& axis, const Eigen::Vector4d& w);

// 3 x 4: change of AboutLine(axis, angle) * p per those parameters.
Eigen::Matrix<double, 3, 4> LineJacobian(const AxisLine& axis, const Eigen::Vector3d& p, double angle_rad);

}  // namespace sixpoint::metrology
