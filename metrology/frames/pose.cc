#include "metrology/frames/pose.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {

Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Matrix3d RotationFromVector(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity() + Skew(rotation_vector);
  return Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix();
}

Eigen::Vector3d VectorFromRotation(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

Eigen::Matrix3d RotationFromCardan(const CardanAngles& angles) {
  return (Eigen::AngleAxisd(angles.gamma, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(angles.beta, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angles.alpha, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

CardanAngles CardanFromRotation(const Eigen::Matrix3d& r) {
  return {std::atan2(r(2, 1), r(2, 2)), std::atan2(-r(2, 0), std::hypot(r(2, 1), r(2, 2))),
          std::atan2(r(1, 0), r(0, 0))};
}

Eigen::Matrix<double, 3, 6> PointJacobian(const Eigen::Vector3d& point_mm, const Eigen::Vector3d& reference_mm) {
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << -Skew(point_mm - reference_mm), Eigen::Matrix3d::Identity();
  return jacobian;
}

Eigen::Isometry3d Perturbed(const Eigen::Isometry3d& target_from_source, const Vector6d& perturbation,
                            const Eigen::Vector3d& reference_mm) {
  const Eigen::Matrix3d turn = RotationFromVector(perturbation.head<3>());
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
  moved.linear() = turn * target_from_source.linear();
  moved.translation() =
      turn * (target_from_source.translation() - reference_mm) + reference_mm + perturbation.tail<3>();
  return moved;
}

// It is convex in the point: greatest at a corner.
double GreatestDisplacement_mm(const Eigen::AlignedBox3d& box_mm, const Eigen::Isometry3d& one,
                               const Eigen::Isometry3d& other) {
  double greatest_mm = 0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner = box_mm.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    greatest_mm = std::max(greatest_mm, (one * corner - other * corner).norm());
  }
  return greatest_mm;
}

}  // namespace sixpoint::metrology
