// Rigid transforms and their covariance.
//
// Frames: sensor, machine (the bed's X, Y, Z), zero (the part where it stands at A = B = 0, machine coordinates), part
// (CAD). A transform is named for what it maps: x_in_machine = machine_from_sensor * x_in_sensor. Units: mm and
// radians. Kernels use Eigen::Isometry3d; absence is std::optional, never identity.
#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <vector>

namespace sixpoint::metrology {

using Points = std::vector<Eigen::Vector3d>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

// What a covariance or a pose is before it was computed or read. Left so it makes all that rests on it NaN, which every check refuses;
// a zero would pass for what is exactly known, an identity for a pose.
template <typename Matrix>
Matrix NotYet() {
  return Matrix::Constant(std::numeric_limits<double>::quiet_NaN());
}
template <>
inline Eigen::Isometry3d NotYet<Eigen::Isometry3d>() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.matrix().topRows<3>().setConstant(std::numeric_limits<double>::quiet_NaN());
  return pose;
}

// The skew-symmetric matrix of v: cross(v, x) = Skew(v) * x.
Eigen::Matrix3d Skew(const Eigen::Vector3d& v);

// Rotation by |v| radians about v, and its inverse (angle in [0, pi]).
Eigen::Matrix3d RotationFromVector(const Eigen::Vector3d& rotation_vector);
Eigen::Vector3d VectorFromRotation(const Eigen::Matrix3d& rotation);

// R = Rz(gamma) Ry(beta) Rx(alpha), the paper's order (CONF 3.4); radians. Inverse for |beta| < pi/2.
struct CardanAngles {
  double alpha = 0, beta = 0, gamma = 0;
};
Eigen::Matrix3d RotationFromCardan(const CardanAngles& angles);
CardanAngles CardanFromRotation(const Eigen::Matrix3d& rotation);

// Covariance of a target_from_source. The perturbation w = (rotation vector, translation) moves a point p of the target
// frame to exp(w_r) (p - reference) + reference + w_t. Order of values: rotation x, y, z (rad), translation x, y, z
// (mm).
struct PoseCovariance {
  // None by default: an uncertainty of 0 is stated, never left out.
  PoseCovariance(const Matrix6d& values_in, const Eigen::Vector3d& reference_in_mm)
      : values(values_in), reference_mm(reference_in_mm) {}

  Matrix6d values;
  Eigen::Vector3d reference_mm;
};

// 3 x 6 Jacobian of a point (target frame) with respect to the perturbation above.
Eigen::Matrix<double, 3, 6> PointJacobian(const Eigen::Vector3d& point_mm, const Eigen::Vector3d& reference_mm);

// target_from_source after the perturbation.
Eigen::Isometry3d Perturbed(const Eigen::Isometry3d& target_from_source, const Vector6d& perturbation,
                            const Eigen::Vector3d& reference_mm);

// Between two poses, over all of a box of the source frame.
double GreatestDisplacement_mm(const Eigen::AlignedBox3d& box_mm, const Eigen::Isometry3d& one,
                               const Eigen::Isometry3d& other);

}  // namespace sixpoint::metrology
