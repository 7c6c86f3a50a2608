// The rotary axes from a sphere fixed to the table and probed at many poses (METHODS 4; CONF 3.5.3).
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <vector>

#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::metrology {

struct SpherePose {
  double a_rad = 0;
  double b_rad = 0;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  // machine frame
  bool held_out = false;                                // kept for the check
};

struct RotationOptions {
  RotaryAxes nominal;                  // directions and a point on each, from the machine's record
  double standard_uncertainty_mm = 0;  // of one coordinate of a probed centre; 0: estimated from the residuals
};

struct RotationCalibration {
  RotaryAxes axes;  // each point is the one of its axis nearest to the nominal point of that axis
  Eigen::Vector3d sphere_in_zero_mm = Eigen::Vector3d::Zero();
  // Order of RotaryAxes::ParameterJacobian, at the axes above.
  Matrix8d covariance = Matrix8d::Zero();
  Eigen::Vector3d point_c_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d point_c_covariance_mm2 = Eigen::Matrix3d::Zero();
  double noise_mm = 0;         // of one coordinate, as used for the covariance
  double residual_rms_mm = 0;  // distances, poses of the fit
  double check_rms_mm = 0;     // distances, held-out poses; 0 where there are none
  int check_count = 0;
  double condition_number = 0;  // of the scaled Jacobian; an angle counts as its effect at the sphere's distance
  int iterations = 0;
  bool converged = false;
  std::vector<double> distances_mm;  // of each pose given, in its order
};

// Both axes as lines and the sphere's place at A = B = 0, by least squares over the poses that are not held out.
// INVALID_ARGUMENT for values that are not finite; FAILED_PRECONDITION naming the axis that the poses do not determine,
// poses that do not agree (more than 0.2 mm about the fit), or axes far from the record (10 mm, 2 deg).
absl::StatusOr<RotationCalibration> CalibrateRotation(const std::vector<SpherePose>& poses,
                                                      const RotationOptions& options);

// The paper's optimised procedure: Point C alone, both axes through it with their nominal directions; each probed centre
// against the first one carried about C.
absl::StatusOr<RotationCalibration> CalibratePointC(const std::vector<SpherePose>& poses,
                                                    const RotationOptions& options);

}  // namespace sixpoint::metrology
