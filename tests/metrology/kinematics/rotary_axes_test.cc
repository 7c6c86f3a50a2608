#include "metrology/kinematics/rotary_axes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sixpoint::metrology {
namespace {

RotaryAxes TiltedAxes() {
  return {{Eigen::Vector3d(1e-4, 1, 3e-6).normalized(), {26.63, 54.88, -193.32}},
          {Eigen::Vector3d(1, -1e-4, 2e-5).normalized(), {26.63, 54.87, -193.324}}};
}

TEST(RotaryAxes, IdealAxesAreThePapersRyRxAboutC) {
  const Eigen::Vector3d c(26, 55, -193), p(70, 60, -180);
  const RotaryAxes axes{{Eigen::Vector3d::UnitY(), c}, {Eigen::Vector3d::UnitX(), c}};
  const double a = 0.7, b = -1.9;
  // CONF 3.1, written out by hand.
  Eigen::Matrix3d ry, rx;
  ry << std::cos(a), 0, std::sin(a), 0, 1, 0, -std::sin(a), 0, std::cos(a);
  rx << 1, 0, 0, 0, std::cos(b), -std::sin(b), 0, std::sin(b), std::cos(b);
  EXPECT_LT((axes.MachineFromZero(a, b) * p - (c + ry * rx * (p - c))).norm(), 1e-12);
  EXPECT_LT((axes.PointC() - c).norm(), 1e-12);
}

TEST(RotaryAxes, PointsOnTheLineStay) {
  const AxisLine axis = TiltedAxes().a;
  EXPECT_LT(
      (AboutLine(axis, 1.0) * (axis.point_mm + 40 * axis.direction) - (axis.point_mm + 40 * axis.direction)).norm(),
      1e-12);
}

TEST(RotaryAxes, TangentBasisIsAcrossAndOrthonormal) {
  for (const Eigen::Vector3d& d : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, -1),
                                   Eigen::Vector3d(1, 1, 1).normalized()}) {
    Eigen::Matrix3d frame;
    frame << TangentBasis(d), d;
    EXPECT_LT((frame.transpose() * frame - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  }
}

TEST(RotaryAxes, PointCIsNearestToTheOtherAxis) {
  const RotaryAxes axes = TiltedAxes();
  const Eigen::Vector3d c = axes.PointC();
  const auto distance_to_b = [&](const Eigen::Vector3d& p) {
    return (p - axes.b.point_mm).cross(axes.b.direction).norm();
  };
  EXPECT_LT(distance_to_b(c), distance_to_b(c + 0.01 * axes.a.direction));
  EXPECT_LT(distance_to_b(c), distance_to_b(c - 0.01 * axes.a.direction));
  EXPECT_LT((c - axes.a.point_mm).cross(axes.a.direction).norm(), 1e-12);
}

TEST(RotaryAxes, AngleJacobianIsTheDerivativeOfTheTurn) {
  const RotaryAxes axes = TiltedAxes();
  const Eigen::Vector3d p(70, 60, -180);
  const double a = -0.8, b = 2.5, step = 1e-6;
  const Eigen::Matrix<double, 3, 2> jacobian = axes.AngleJacobian(p, a, b);
  const Eigen::Vector3d by_a = axes.MachineFromZero(a + step, b) * p - axes.MachineFromZero(a - step, b) * p;
  const Eigen::Vector3d by_b = axes.MachineFromZero(a, b + step) * p - axes.MachineFromZero(a, b - step) * p;
  EXPECT_LT((jacobian.col(0) - by_a / (2 * step)).norm(), 1e-6);
  EXPECT_LT((jacobian.col(1) - by_b / (2 * step)).norm(), 1e-6);
}

TEST(RotaryAxes, ParameterJacobianIsTheDerivativeOfThePerturbedAxes) {
  const RotaryAxes axes = TiltedAxes();
  const Eigen::Vector3d p(70, 60, -180);
  const double a = -0.8, b = 2.5;
  const Eigen::Matrix<double, 3, 8> jacobian = axes.ParameterJacobian(p, a, b);
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 8; ++k) {
    const Eigen::Matrix<double, 8, 1> step = kStep * Eigen::Matrix<double, 8, 1>::Unit(k);
    const Eigen::Vector3d slope =
        (axes.Perturbed(step).MachineFromZero(a, b) * p - axes.Perturbed(-step).MachineFromZero(a, b) * p) /
        (2 * kStep);
    // Rounding: 1e-14 * 200 mm / 1e-6.
    EXPECT_LT((slope - jacobian.col(k)).norm(), 1e-6) << "parameter " << k;
  }
}

}  // namespace
}  // namespace sixpoint::metrology
