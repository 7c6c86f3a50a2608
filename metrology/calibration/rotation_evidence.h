// What the ways of finding the rotary axes share: checks of the poses, the error curves, the check against the record.
#pragma once

#include <string>
#include <vector>

#include "metrology/calibration/rotation_calibration.h"

namespace sixpoint::metrology {

// "A and B".
std::string BothAxes(const RotationOptions& options);

// Finite, on the machine and within the axes' limits.
absl::Status CheckPoses(const std::vector<SpherePose>& poses, const RotationOptions& options);
// Poses of the fit that turn both axes.
absl::Status CheckTurns(const std::vector<SpherePose>& poses, const RotationOptions& options);
// At the angles that the axes reached, where they have tables.
std::vector<SpherePose> ReachedPoses(const std::vector<SpherePose>& commanded, const RotationOptions& options);

Eigen::Vector3d ResidualOf(const RotaryAxes& axes, const Eigen::Vector3d& sphere_in_zero_mm, const SpherePose& pose);
// Where the sphere stands at zero so that the poses (those of the fit, or all) agree best with the axes.
Eigen::Vector3d BestSphere(const RotaryAxes& axes, const std::vector<SpherePose>& poses, bool all);

// Error curves, residuals and Point C of the axes and the sphere that the result has.
void AddEvidence(const std::vector<SpherePose>& poses, const RotationOptions& options, RotationCalibration* result);
// Both axes of the result through Point C, and the covariance that follows.
void SetPointC(const Eigen::Vector3d& point_c_mm, const Eigen::Matrix3d& covariance_mm2, RotationCalibration* result);
// Near the record, and no pose of the fit far from it.
absl::Status CheckAgreement(const std::vector<SpherePose>& poses, const RotationOptions& options,
                            const RotationCalibration& result);

}  // namespace sixpoint::metrology
