// How far apart two ways put the same part, against what noise and calibrations explain
// (docs/methods/uncertainty.md, disagreement).
//
// A six-point nest and a best fit of the same scans differ by chance, and by what the part's shape differs from its CAD. The
// calibrations move both alike: only the difference of their sensitivities counts. The noises are added as if independent,
// which is not too little: of an efficient best fit and any other estimate the covariance is the best fit's own (Hausman 1978).
#pragma once

#include <absl/status/statusor.h>

#include "metrology/registration/best_fit.h"

namespace sixpoint::metrology {

// Standard uncertainties. The greatest of all displacements is no single draw: along itself, at a place that the six errors
// of a pose choose, its ratio's square is at most chi-squared of six degrees of freedom, of which 99 % lie below 4.1^2. At 3,
// 5 % of true blades were flagged by six pairs (bench/registration, part disagreement).
constexpr double kDisagreementLimit = 4.1;

struct Disagreement {
  double greatest_mm = 0;                              // displacement of a point of the part, where it is greatest
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();  // that point, part frame
  double standard_uncertainty_mm = 0;                  // of the displacement there, along itself
  double ratio = 0;                                    // 0 where there is no displacement
  bool beyond = false;                                 // the ratio is more than kDisagreementLimit
};

// Over the surface's vertices within the regions asked for; where a region holds none, the surface nearest to its middle.
// more_covariance: of the poses' difference, from what both do not share beside noise and calibrations (order of
// PoseCovariance). INVALID_ARGUMENT: one of the two has not converged.
absl::StatusOr<Disagreement> DisagreementOf(const Surface& surface, const PoseFit& fit, const PoseFit& other,
                                            const MachineCalibration& calibration, const Matrix6d& more_covariance,
                                            const FitOptions& options);

}  // namespace sixpoint::metrology
