// The pose that six datum points hold, from a best fit of the same scans (docs/methods/registration.md, six-point).
//
// Each datum's distance along its normal comes out of a local robust quadratic fit of the scan's deviation there; then, once,
// the CAD is fitted to those six points alone: least squares over the six pairs (the paper's), or the one pose that takes all
// six distances to zero (a 3-2-1 nest; it multiplies every local error by the nest's condition).
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/registration/best_fit.h"

namespace sixpoint::metrology {

enum class SixPointVariant { kPairs, kNormals };

struct DatumPoint {
  std::string name;
  Eigen::Vector3d point_mm;  // part frame, on the surface
  Eigen::Vector3d normal;    // outward unit normal there
};

// A best fit that has not converged comes back as it is. INVALID_ARGUMENT: not six points, or points or normals that are not
// the surface's. A degenerate nest is kNotDetermined, with its condition number; a datum without points is
// kTooLittleOverlap.
absl::StatusOr<PoseFit> FitSixPoints(const Surface& surface, const std::vector<ScanPortion>& portions,
                                     const std::vector<DatumPoint>& datums, const PoseFit& best_fit,
                                     SixPointVariant variant, const MachineCalibration& calibration,
                                     const FitOptions& options);

}  // namespace sixpoint::metrology
