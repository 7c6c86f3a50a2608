#include "metrology/registration/disagreement.h"

#include <absl/status/status.h>

#include <cmath>
#include <limits>

#include "metrology/statistics/standard_deviation.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

Points PlacesOf(const Surface& surface, const FitOptions& options) {
  Points places;
  for (const Eigen::Vector3d& vertex : surface.mesh().vertices_mm)
    if (InRegions(options, vertex)) places.push_back(vertex);
  for (const Region& region : options.regions_in) places.push_back(surface.Closest(region.centre_mm).point_mm);
  return places;
}

// Both hold the same directions, and are off by the same.
Matrix6d CovarianceOfHeld(const PlacedPose& placed, const PlacedPose& beside) {
  Matrix6d covariance = Matrix6d::Zero();
  for (const ErrorSource& source : placed.sources)
    for (const ErrorSource& other : beside.sources)
      if (source.name == kHeldDirections && other.name == kHeldDirections) {
        const Matrix6d apart = source.pose_per_sigma - other.pose_per_sigma;
        covariance += apart * apart.transpose();
      }
  return covariance;
}

}  // namespace

absl::StatusOr<Disagreement> DisagreementOf(const Surface& surface, const PoseFit& fit, const PoseFit& other,
                                            const MachineCalibration& calibration, const Matrix6d& more_covariance,
                                            const FitOptions& options) {
  if (!fit.placed || !other.placed) return Refuse("disagreement", "a pose that has not converged", "two that have");
  const PlacedPose &placed = *fit.placed, &beside = *other.placed;
  Disagreement found;
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& place : PlacesOf(surface, options)) {
    const Eigen::Vector3d moved = placed.zero_from_part * place - beside.zero_from_part * place;
    if (moved.norm() > found.greatest_mm) {
      found.greatest_mm = moved.norm();
      found.point_mm = place;
      displacement = moved;
    }
  }
  if (found.greatest_mm == 0) return found;
  // Both covariances turn about the part's centroid at zero, micrometres apart.
  const auto sensitivity = placed.calibration_sensitivity - beside.calibration_sensitivity;
  Matrix6d covariance = placed.noise_covariance.values + beside.noise_covariance.values + more_covariance +
                        sensitivity * CovarianceOf(calibration) * sensitivity.transpose();
  covariance += CovarianceOfHeld(placed, beside);
  const Vector6d along =
      PointJacobian(placed.zero_from_part * found.point_mm, placed.covariance.reference_mm).transpose() * displacement /
      found.greatest_mm;
  found.standard_uncertainty_mm = StandardDeviation(along.dot(covariance * along));
  found.ratio = found.standard_uncertainty_mm > 0 ? found.greatest_mm / found.standard_uncertainty_mm
                                                  : std::numeric_limits<double>::infinity();
  found.beyond = found.ratio > kDisagreementLimit;
  return found;
}

}  // namespace sixpoint::metrology
