#include "metrology/inspection/hole_error.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

// Standard deviation of |v| for v with this covariance.
template <int kSize>
double LengthUncertainty(const Eigen::Matrix<double, kSize, 1>& v,
                         const Eigen::Matrix<double, kSize, kSize>& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, kSize, kSize>> solver(covariance, Eigen::EigenvaluesOnly);
  const double greatest = std::max(0.0, solver.eigenvalues()[kSize - 1]);
  if (v.squaredNorm() < 9 * greatest) return std::sqrt(greatest);
  return std::sqrt(std::max(0.0, v.dot(covariance * v) / v.squaredNorm()));
}

}  // namespace

HoleError HoleErrorOf(const NominalPin& nominal, const PinFit& fit, const Eigen::Matrix<double, 5, 5>& covariance) {
  HoleError error;
  const Eigen::Vector3d direction = nominal.axis + fit.across * fit.slope;
  const Eigen::Vector3d offset = fit.across * fit.offset_mm;
  const double facing = nominal.normal.dot(direction);
  const double along = -nominal.normal.dot(offset) / facing;
  const Eigen::Vector3d displacement = offset + along * direction;
  error.start_in_part_mm = nominal.start_mm + displacement;
  error.axis_in_part = direction.normalized();
  error.position_mm = displacement.norm();
  error.inclination_rad = std::atan(fit.slope.norm());

  // d displacement = (I - direction normal' / facing) (d offset + along d direction)
  const Eigen::Matrix3d onto_surface = Eigen::Matrix3d::Identity() - direction * nominal.normal.transpose() / facing;
  Eigen::Matrix<double, 3, 4> jacobian;
  jacobian << onto_surface * fit.across, along * onto_surface * fit.across;
  const Eigen::Matrix3d displacement_covariance = jacobian * covariance.topLeftCorner<4, 4>() * jacobian.transpose();
  error.position_standard_uncertainty_mm = LengthUncertainty<3>(displacement, displacement_covariance);
  error.inclination_standard_uncertainty_rad =
      LengthUncertainty<2>(fit.slope, Eigen::Matrix2d(covariance.block<2, 2>(2, 2))) / (1 + fit.slope.squaredNorm());
  return error;
}

}  // namespace sixpoint::metrology
