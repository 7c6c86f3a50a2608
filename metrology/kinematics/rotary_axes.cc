#include "metrology/kinematics/rotary_axes.h"

#include <cmath>

namespace sixpoint::metrology {
namespace {

// Turns the direction towards e1, e2 by small angles and shifts the point.
AxisLine PerturbedLine(const AxisLine& axis, const Eigen::Vector4d& w) {
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(axis.direction);
  return {(axis.direction + across * w.head<2>()).normalized(), axis.point_mm + across * w.tail<2>()};
}

// 3 x 4: change of AboutLine(axis, angle) * p per parameter of the line.
Eigen::Matrix<double, 3, 4> LineJacobian(const AxisLine& axis, const Eigen::Vector3d& p, double angle) {
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(axis.direction);
  const Eigen::Vector3d& d = axis.direction;
  const Eigen::Vector3d r = p - axis.point_mm;
  const double c = std::cos(angle), s = std::sin(angle);
  Eigen::Matrix<double, 3, 4> jacobian;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector3d e = across.col(k);
    // Rodrigues' formula differentiated along e.
    jacobian.col(k) = s * e.cross(r) + (1 - c) * (e * d.dot(r) + d * e.dot(r));
    jacobian.col(2 + k) = e - (c * e + s * d.cross(e));
  }
  return jacobian;
}

}  // namespace

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

Eigen::Isometry3d RotaryAxes::MachineFromZero(double a_rad, double b_rad) const {
  return AboutLine(a, a_rad) * AboutLine(b, b_rad);
}

Eigen::Matrix<double, 3, 8> RotaryAxes::ParameterJacobian(const Eigen::Vector3d& point_in_zero_mm, double a_rad,
                                                          double b_rad) const {
  const Eigen::Isometry3d about_a = AboutLine(a, a_rad);
  const Eigen::Vector3d after_b = AboutLine(b, b_rad) * point_in_zero_mm;
  Eigen::Matrix<double, 3, 8> jacobian;
  jacobian << LineJacobian(a, after_b, a_rad), about_a.linear() * LineJacobian(b, point_in_zero_mm, b_rad);
  return jacobian;
}

RotaryAxes RotaryAxes::Perturbed(const Eigen::Matrix<double, 8, 1>& perturbation) const {
  return {PerturbedLine(a, perturbation.head<4>()), PerturbedLine(b, perturbation.tail<4>())};
}

Eigen::Vector3d RotaryAxes::PointC() const {
  const Eigen::Vector3d w = b.point_mm - a.point_mm;
  const double across = a.direction.dot(b.direction);
  const double along = (w.dot(a.direction) - across * w.dot(b.direction)) / (1 - across * across);
  return a.point_mm + along * a.direction;
}

}  // namespace sixpoint::metrology
