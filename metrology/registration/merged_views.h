// Do the scans put the surface at the same place where they overlap, as far as noise and calibrations explain? They do not
// where the part was turned about another centre than the calibration says, or to another angle
// (docs/methods/registration.md, merged views).
//
// FitEvidence's agreements compare scans with noise alone, which right calibrations too are beyond: what calibrations
// leave is of the noise's size. Here the differences are asked for the one thing that is wrong with a machine: the errors of
// the calibration parameters (kinematics/calibration_parameters.h) that would explain them, by generalised least squares over all places seen twice, against
// what these errors may be. The shape's own deviations are the same in both scans and drop out.
#pragma once

#include <absl/status/statusor.h>

#include "metrology/registration/best_fit.h"

namespace sixpoint::metrology {

constexpr double kMergeConfidence = 0.999;  // of right calibrations so many are not flagged

// Of a converged fit of the same portions. INVALID_ARGUMENT: it is not; CANCELLED as FitToSurface.
absl::StatusOr<MergeTest> TestMerge(const Surface& surface, const std::vector<ScanPortion>& portions,
                                    const PoseFit& fit, const MachineCalibration& calibration,
                                    const FitOptions& options);

}  // namespace sixpoint::metrology
