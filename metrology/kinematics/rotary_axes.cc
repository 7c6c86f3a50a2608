#include "metrology/kinematics/rotary_axes.h"

#include <array>
#include <string>

namespace sixpoint::metrology {
namespace {

std::array<JointMotion, 2> MotionsOf(const RotaryAxes& axes) {
  return {JointMotion{JointKind::kRotary, axes.a}, JointMotion{JointKind::kRotary, axes.b}};
}

}  // namespace

Eigen::Isometry3d RotaryAxes::MachineFromZero(double a_rad, double b_rad) const {
  const double positions[] = {a_rad, b_rad};
  return Carry(MotionsOf(*this).data(), positions, 2);
}

Eigen::Matrix<double, 3, kAxisParameterCount> RotaryAxes::ParameterJacobian(const Eigen::Vector3d& point_in_zero_mm,
                                                                            double a_rad, double b_rad) const {
  const double positions[] = {a_rad, b_rad};
  Eigen::Matrix<double, 3, kAxisParameterCount> jacobian;
  CarryParameterJacobian(MotionsOf(*this).data(), positions, 2, point_in_zero_mm, jacobian);
  return jacobian;
}

Eigen::Matrix<double, 3, 2> RotaryAxes::AngleJacobian(const Eigen::Vector3d& point_in_zero_mm, double a_rad,
                                                      double b_rad) const {
  const double positions[] = {a_rad, b_rad};
  Eigen::Matrix<double, 3, 2> jacobian;
  CarryPositionJacobian(MotionsOf(*this).data(), positions, 2, point_in_zero_mm, jacobian);
  return jacobian;
}

absl::StatusOr<RotaryAxes> RotaryAxes::Of(const JointChain& chain) {
  const std::vector<int> rotary = chain.PartSideRotary();
  if (rotary.size() != 2)
    return absl::FailedPreconditionError("kinematics.part_side: " + std::to_string(rotary.size()) +
                                         " rotary joints, want two, the first carrying the second");
  return RotaryAxes{chain.motion(rotary[0]).line, chain.motion(rotary[1]).line};
}

RotaryAxes RotaryAxes::Perturbed(const Eigen::Matrix<double, kAxisParameterCount, 1>& perturbation) const {
  return {PerturbedLine(a, perturbation.head<4>()), PerturbedLine(b, perturbation.tail<4>())};
}

Eigen::Affine3d RotaryAxes::Growth(double ratio) const {
  return Eigen::Translation3d(b.point_mm) * Eigen::Scaling(ratio) * Eigen::Translation3d(-b.point_mm);
}

Eigen::Vector3d RotaryAxes::PointC() const {
  const Eigen::Vector3d w = b.point_mm - a.point_mm;
  const double across = a.direction.dot(b.direction);
  const double along = (w.dot(a.direction) - across * w.dot(b.direction)) / (1 - across * across);
  return a.point_mm + along * a.direction;
}

}  // namespace sixpoint::metrology
