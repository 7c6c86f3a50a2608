#include "metrology/inspection/hole_error.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "metrology/statistics/distance_quantile.h"
#include "metrology/statistics/standard_deviation.h"

namespace sixpoint::metrology {
namespace {

// How uncertain |v| is.
struct LengthUncertainty {
  Eigen::Vector3d along;  // unit: it is that of v's component along this
  double standard_uncertainty;
  double coverage_factor;
};
LengthUncertainty UncertaintyOfLength(const Eigen::Vector3d& v, const Eigen::Matrix3d& covariance) {
  constexpr double kProbability = 0.95, kUsualFactor = 1.959964;  // the normal distribution's
  constexpr double kNearZero = 2.6;   // 95 % of two normal components lie within 2.45, and a little
  constexpr double kReaches = 1.01;   // beyond what was seen: it is not exactly linear
  constexpr double kNothing = 1e-12;  // of the greatest variance: a direction without any
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const double variance = std::max(solver.eigenvalues()[2], 0.0), length = v.norm();  // NaN stays
  const Eigen::Vector3d along =
      length > 0 ? Eigen::Vector3d(v / length) : Eigen::Vector3d(solver.eigenvectors().col(2));
  const double along_sigma = StandardDeviation(along.dot(covariance * along));
  double squared = 0;  // how far v is from zero, in its own uncertainty
  for (int k = 0; k < 3; ++k)
    if (solver.eigenvalues()[k] > kNothing * variance)
      squared += std::pow(solver.eigenvectors().col(k).dot(v), 2) / solver.eigenvalues()[k];
  if (variance == 0) return {along, 0, kUsualFactor};
  if (squared >= kNearZero * kNearZero) {
    // What lies across lengthens it in second order (GUM 5.1.2, note), by w^2 / (2 length) on the mean: not taken off, and so uncertain.
    const double lengthened = (covariance.trace() - along_sigma * along_sigma) / (2 * length);
    return {along, along_sigma, kUsualFactor * std::hypot(1, lengthened / along_sigma)};
  }
  // So near zero all of it may be its error: then that is as long as was seen, and seldom longer than the quantile.
  const double greatest = std::sqrt(variance), quantile = DistanceQuantile(covariance, kProbability);
  const double expanded = std::max(kUsualFactor * along_sigma, std::min(kReaches * length, quantile));
  return {solver.eigenvectors().col(2), greatest, expanded / greatest};
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
  error.start_per_parameter.leftCols<4>() = jacobian;
  const Eigen::Matrix3d displacement_covariance = jacobian * covariance.topLeftCorner<4, 4>() * jacobian.transpose();
  const LengthUncertainty position = UncertaintyOfLength(displacement, displacement_covariance);
  error.position_standard_uncertainty_mm = position.standard_uncertainty;
  error.position_coverage_factor = position.coverage_factor;
  error.position_per_parameter.head<4>() = position.along.transpose() * jacobian;
  Eigen::Matrix3d slope_covariance = Eigen::Matrix3d::Zero();
  slope_covariance.topLeftCorner<2, 2>() = covariance.block<2, 2>(2, 2);
  const LengthUncertainty slope =
      UncertaintyOfLength(Eigen::Vector3d(fit.slope.x(), fit.slope.y(), 0), slope_covariance);
  error.inclination_standard_uncertainty_rad = slope.standard_uncertainty / (1 + fit.slope.squaredNorm());
  error.inclination_coverage_factor = slope.coverage_factor;
  return error;
}

}  // namespace sixpoint::metrology
