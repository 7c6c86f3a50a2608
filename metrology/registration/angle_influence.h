// How the angles that scans were taken at make a pose uncertain, where tables were applied to them
// (docs/methods/uncertainty.md, angles of scans).
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <vector>

#include "metrology/registration/pose_fit.h"
#include "metrology/registration/scan_portion.h"

namespace sixpoint::metrology {

// The fit whose pose it is, on other portions of the same scans.
using Refit = std::function<absl::StatusOr<PoseFit>(const std::vector<ScanPortion>& portions)>;

// The distinct angles of those axes whose table was applied, a before b, each in the order of the portions; without their
// influence on a pose.
std::vector<AngleInfluence> TabledAngles(const std::vector<ScanPortion>& portions,
                                         const RotaryPositioning& positioning);

// Their influence on a converged fit: one refit for each with the angle taken a little greater, so that any method's own way
// from points to pose is followed, robust loss and all; and one for each axis with all its angles taken greater, to which the
// influences of its angles add up: a reversal is common to them. FAILED_PRECONDITION naming the angle whose refit does not
// converge, INVALID_ARGUMENT: the fit itself has not; else as refit.
absl::StatusOr<std::vector<AngleInfluence>> InfluencesOf(const std::vector<ScanPortion>& portions,
                                                         const MachineCalibration& calibration, const PoseFit& fit,
                                                         const Refit& refit);

}  // namespace sixpoint::metrology
