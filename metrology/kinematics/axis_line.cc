#include "metrology/kinematics/axis_line.h"

#include <cmath>

namespace sixpoint::metrology {

Eigen::Matrix<double, 3, 2> TangentBasis(const Eigen::Vector3d& direction) {
  // Across the machine axis that the direction is farthest from: fixed for any axis near X, Y or Z.
  Eigen::Vector3d helper = Eigen::Vector3d::UnitX();
  if (std::abs(direction.x()) > std::abs(direction.y()) || std::abs(direction.x()) > std::abs(direction.z()))
    helper = std::abs(direction.y()) < std::abs(direction.z()) ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = direction.cross(helper).normalized();
  basis.col(1) = direction.cross(basis.col(0)).normalized();
  return basis;
}

Eigen::Isometry3d AboutLine(const AxisLine& axis, double angle_rad) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle_rad, axis.direction).toRotationMatrix();
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = turn;
  result.translation() = axis.point_mm - turn * axis.point_mm;
  return result;
}

AxisLine PerturbedLine(const AxisLine& axis, const Eigen::Vector4d& w) {
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(axis.direction);
  return {(axis.direction + across * w.head<2>()).normalized(), axis.point_mm + across * w.tail<2>()};
}

Eigen::Matrix<double, 3, 4> LineJacobian(const AxisLine& axis, const Eigen::Vector3d& p, double angle_rad) {
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(axis.direction);
  const Eigen::Vector3d& d = axis.direction;
  const Eigen::Vector3d r = p - axis.point_mm;
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Eigen::Matrix<double, 3, 4> jacobian;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector3d e = across.col(k);
    // Rodrigues' formula differentiated along e.
    jacobian.col(k) = s * e.cross(r) + (1 - c) * (e * d.dot(r) + d * e.dot(r));
    jacobian.col(2 + k) = e - (c * e + s * d.cross(e));
  }
  return jacobian;
}

}  // namespace sixpoint::metrology
