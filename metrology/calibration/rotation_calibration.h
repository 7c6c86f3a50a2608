// The two rotary axes that carry the part, A and B, B and C or any others, from a sphere fixed to the table and probed at
// many poses (docs/methods/rotary_axes.md; CONF 3.5.3). `a` is the axis on the bed, `b` the one that it carries.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "metrology/calibration/residual_judgement.h"
#include "metrology/frames/pose.h"
#include "metrology/kinematics/joint_chain.h"
#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::metrology {

struct SpherePose {
  double a_rad = 0;
  double b_rad = 0;
  // Machine frame, where linear joints on the part's side stand at 0: controls show them so.
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  bool held_out = false;  // kept for the check
  Travel a_travel = Travel::kUnknown, b_travel = Travel::kUnknown;
};

// What the machine's record says of one rotary joint, beside its line.
struct RotaryJoint {
  std::string axis;
  double minimum_rad = -std::numeric_limits<double>::infinity();
  double maximum_rad = std::numeric_limits<double>::infinity();
  std::optional<AngleTable> table = std::nullopt;  // applied to the poses' angles
};

struct RotationOptions {
  RotaryAxes nominal;                  // directions and a point on each, from the machine's record
  double standard_uncertainty_mm = 0;  // of one coordinate of a probed centre; 0: estimated from the residuals
  std::array<RotaryJoint, 2> joints{RotaryJoint{"A"}, RotaryJoint{"B"}};

  // From a machine whose part rides on two rotary joints; with their tables where the chain has them.
  static absl::StatusOr<RotationOptions> Of(const JointChain& chain);
};

struct RotationCalibration {
  RotaryAxes axes;  // each point is the one of its axis nearest to the nominal point of that axis
  Eigen::Vector3d sphere_in_zero_mm = Eigen::Vector3d::Zero();
  AxesCovariance covariance = NotYet<AxesCovariance>();     // at the axes above
  LinearResponse linear_response = LinearResponse::Zero();  // of the axes, to what the sphere was probed with
  Eigen::Vector3d point_c_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d point_c_covariance_mm2 = NotYet<Eigen::Matrix3d>();
  double noise_mm = 0;  // of one coordinate, as used for the covariance
  double degrees_of_freedom =
      std::numeric_limits<double>::infinity();  // of noise_mm, where it was seen in the residuals
  double residual_rms_mm = 0;                   // distances, poses of the fit
  double check_rms_mm = 0;                      // distances, held-out poses; 0 where there are none
  int check_count = 0;
  double condition_number = 0;  // of the scaled Jacobian; an angle counts as its effect at the sphere's distance
  int iterations = 0;
  bool converged = false;
  // The error curves, of each pose given, in its order: about the axes found, and about those of the record with the
  // sphere where it suits them best.
  std::vector<double> distances_mm;
  std::vector<double> before_mm;
  // Of poses that took no part; of POINT_C and STANDARD that the axes meet and stand as the record has them, which they claim.
  std::vector<ResidualJudgement> judgements;
};

// Both axes as lines and the sphere's place at A = B = 0, by least squares over the poses that are not held out.
// INVALID_ARGUMENT for values that are not finite or beyond an axis's limits; FAILED_PRECONDITION naming the axis that the poses do not determine,
// poses that do not agree (more than 0.2 mm about the fit), or axes far from the record (10 mm, 2 deg).
absl::StatusOr<RotationCalibration> CalibrateRotation(const std::vector<SpherePose>& poses,
                                                      const RotationOptions& options);

// The paper's optimised procedure: Point C alone, both axes through it with their nominal directions; each probed centre
// against the first one carried about C.
absl::StatusOr<RotationCalibration> CalibratePointC(const std::vector<SpherePose>& poses,
                                                    const RotationOptions& options);

// The paper's standard procedure: a gauge with a calibrated bore and face, touched with both axes upright for the bore, and
// with the face level.
struct StandardProbing {
  Points bore_mm;                   // round the bore, at one height
  Points face_mm;                   // on the face, which lies across machine Z
  double face_above_centre_mm = 0;  // calibrated distance, subtracted; negative for a face below
};

// X and Y of Point C from the bore, Z from the face; both axes through it with their nominal directions, which are taken
// as known. The poses, if any, take no part: their error curves are the check.
absl::StatusOr<RotationCalibration> CalibrateStandardCentre(const StandardProbing& probing,
                                                            const std::vector<SpherePose>& poses,
                                                            const RotationOptions& options);

}  // namespace sixpoint::metrology
