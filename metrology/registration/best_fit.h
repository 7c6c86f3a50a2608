// The pose at A = B = 0 from scans of the part's surface (docs/methods/registration.md, best fit).
//
// Robust point-to-surface least squares (Tukey's biweight), Gauss-Newton on the pose's tangent space, the loss annealed from
// the nominal pose's error down to the scanner's noise on some thousands of points; then all points, summed by patches of the
// surface, a patch kept or thrown out as a whole (patch_fit.h). Local is the same on one region.
//
// Same inputs give the same bits on any number of threads. Thread-safe.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/registration/fit_options.h"
#include "metrology/registration/pose_fit.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// Errors as CheckInputs (fit_options.h); CANCELLED: keep_going said so.
absl::StatusOr<PoseFit> FitToSurface(const Surface& surface, const std::vector<ScanPortion>& portions,
                                     const Eigen::Isometry3d& zero_from_part_nominal,
                                     const MachineCalibration& calibration, const FitOptions& options);

}  // namespace sixpoint::metrology
