#include "metrology/frames/pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sixpoint::metrology {
namespace {

constexpr double kPi = 3.14159265358979323846;

TEST(Pose, RotationVectorAndItsInverseAgreeUpToHalfATurn) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    Eigen::Vector3d v(normal(random), normal(random), normal(random));
    v *= (kPi - 1e-3) * (i % 100) / 100.0 / v.norm();
    EXPECT_LT((VectorFromRotation(RotationFromVector(v)) - v).norm(), 1e-9);
  }
}

TEST(Pose, SkewIsTheCrossProduct) {
  const Eigen::Vector3d a(1, -2, 3), b(0.5, 4, -1);
  EXPECT_LT((Skew(a) * b - a.cross(b)).norm(), 1e-15);
}

TEST(Pose, CardanIsRzRyRx) {
  // gamma alone turns x to y, beta alone turns z to x, alpha alone turns y to z.
  EXPECT_LT((RotationFromCardan({0, 0, kPi / 2}) * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_LT((RotationFromCardan({0, kPi / 2, 0}) * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-15);
  EXPECT_LT((RotationFromCardan({kPi / 2, 0, 0}) * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
  const CardanAngles angles{0.1, -0.2, 0.3};
  const CardanAngles found = CardanFromRotation(RotationFromCardan(angles));
  EXPECT_NEAR(found.alpha, angles.alpha, 1e-15);
  EXPECT_NEAR(found.beta, angles.beta, 1e-15);
  EXPECT_NEAR(found.gamma, angles.gamma, 1e-15);
}

TEST(Pose, PointJacobianIsTheDerivativeOfThePerturbedPose) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = RotationFromVector({0.3, -0.2, 0.5});
  pose.translation() = Eigen::Vector3d(10, -20, 30);
  const Eigen::Vector3d source(4, 5, 6), reference(1, 2, 3);
  const Eigen::Matrix<double, 3, 6> jacobian = PointJacobian(pose * source, reference);
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 6; ++k) {
    const Vector6d step = kStep * Vector6d::Unit(k);
    const Eigen::Vector3d slope =
        (Perturbed(pose, step, reference) * source - Perturbed(pose, -step, reference) * source) / (2 * kStep);
    // Central differences: truncation ~ step^2 * |p| ~ 1e-11, rounding ~ 1e-15 * |p| / step ~ 3e-8.
    EXPECT_LT((slope - jacobian.col(k)).norm(), 1e-7);
  }
}

// Of a shift everywhere the same; of a turn that of the corner farthest from its axis.
TEST(Pose, GreatestDisplacementIsThatOfACornerOfTheBox) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-1, -2, -3), Eigen::Vector3d(4, 2, 3));
  const Eigen::Isometry3d pose = Perturbed(Eigen::Isometry3d::Identity(), Vector6d::Constant(0.3), {1, 2, 3});
  const Eigen::Isometry3d shifted = pose * Eigen::Translation3d(0, 0, 0.25);
  EXPECT_NEAR(GreatestDisplacement_mm(box, pose, shifted), 0.25, 1e-12);
  const Eigen::Isometry3d turned = pose * Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitZ());
  EXPECT_NEAR(GreatestDisplacement_mm(box, turned, pose), 2 * std::hypot(4, 2), 1e-12);
}

TEST(Pose, NoPerturbationChangesNothing) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(6350, 1, 2);
  EXPECT_EQ(Perturbed(pose, Vector6d::Zero(), {1, 2, 3}).matrix(), pose.matrix());
}

}  // namespace
}  // namespace sixpoint::metrology
