#include "metrology/inspection/hole_error.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "metrology/statistics/distance_quantile.h"

namespace sixpoint::metrology {
namespace {

// How uncertain |v| is.
struct LengthUncertainty {
  Eigen::Vector3d along;  // unit: it is that of v's component along this
  double standard_uncertainty;
  double coverage_factor;
};
LengthUncertainty UncertaintyOfLength(const Eigen::Vector3d& v, const Eigen::Matrix3d& covariance) {
  constexpr double kProbability = 0.95, kUsualFactor = 2;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const double greatest = std::sqrt(std::max(0.0, solver.eigenvalues()[2]));
  if (v.norm() < 3 * greatest)
    return {solver.eigenvectors().col(2), greatest,
            std::max(kUsualFactor, DistanceQuantile(covariance, kProbability) / greatest)};
  const Eigen::Vector3d along = v.norm() > 0 ? Eigen::Vector3d(v.normalized()) : Eigen::Vector3d::UnitX();
  return {along, std::sqrt(std::max(0.0, along.dot(covariance * along))), kUsualFactor};
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
