// What the ways of finding the rotary axes share: checks of the poses, the error curves, the check against the record.
#pragma once

#include <string>
#include <vector>

#include "metrology/calibration/rotation_calibration.h"
#include "metrology/frames/pose.h"

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
// Point C with its covariance, and how it follows the linear axes.
struct FoundPointC {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_mm2 = NotYet<Eigen::Matrix3d>();
  Eigen::Matrix<double, 3, kLinearParameterCount> linear_response;
};
// Both axes of the result through it, and what follows for them.
void SetPointC(const FoundPointC& found, RotationCalibration* result);

inline constexpr char kAxesMeet[] = "axes that meet and stand as the record has them";
inline constexpr double kLeastProbingNoiseMm = 1e-6;  // below what any coordinate is given in

// Residuals of poses, three rows each, and how they follow the axes' eight parameters and the sphere's three.
struct PoseRows {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residuals_mm;
};
PoseRows RowsOf(const std::vector<SpherePose>& poses, const RotationCalibration& result);

// Poses about axes and a sphere whose eight and three parameters have this covariance. spent: parameters that were fitted to these very poses.
ResidualJudgement JudgePoses(const std::string& of, const std::vector<SpherePose>& poses,
                             const RotationCalibration& result, const Eigen::MatrixXd& covariance, double spent);
// Near the record, and no pose of the fit far from it.
absl::Status CheckAgreement(const std::vector<SpherePose>& poses, const RotationOptions& options,
                            const RotationCalibration& result);

}  // namespace sixpoint::metrology
