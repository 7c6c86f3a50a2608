// What an arm repeats: scans of the artefact, the arm swung away and back in between (CONF 3.3.3).
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <string>
#include <vector>

#include "metrology/calibration/artefact.h"
#include "metrology/calibration/feature_centres.h"
#include "metrology/frames/pose.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

struct ArmStudyOptions {
  // As calibrated. A rotation that is wrong by 0.02 deg changes a displacement by less than the readings' noise does; one
  // that is not known at all (half a degree) by micrometres.
  SensorPose sensor;
  LineSensorOptics optics;
  std::function<bool()> keep_going;  // asked between scans; false stops with CANCELLED
};

// Of the sensor, against the first scan: t_sm changes by translation_mm, and R_sm becomes
// Rz(dgamma) Ry(dbeta) Rx(dalpha) R_sm; axes of options.sensor.
struct ArmDisplacement {
  std::string scan;
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
  CardanAngles angles;
  // Of both fits: rotation vector (rad), translation (mm).
  Matrix6d covariance = NotYet<Matrix6d>();
  double residual_rms_mm = 0;  // along the rays
};

// The first scan gives the artefact's pose; then each scan gives the pose of the sensor from which the artefact, standing
// still, looks as it does: least squares over its upper face and its cones, readings weighed along their rays, those beyond
// five sigma left out. Rigid fits of cloud onto cloud, as the paper has them, would miss dbeta and see half of dgamma: a sensor
// that turns while the encoder moves along X shears the scan (CONF 12). One height determines dbeta by the cones' depth only:
// its covariance says how well. The first displacement is zero. INVALID_ARGUMENT for fewer than five scans or points that are not
// finite; FAILED_PRECONDITION where the artefact is not found in a scan or its fit does not settle.
absl::StatusOr<std::vector<ArmDisplacement>> StudyArm(const std::vector<LineScan>& scans, const Artefact& artefact,
                                                      const ArmStudyOptions& options);

inline constexpr int kFewestArmScans = 5;

// How far an arm stands, once swung, from where it stood on the mean: of the sensor's parameters (order of kSensorParameters), with as
// many degrees of freedom.
struct ArmSpread {
  SensorCovariance covariance = NotYet<SensorCovariance>();
  double degrees_of_freedom = 0;
};
// From the displacements of all scans, the first's too. displacement_sigma: of one displacement by its own two fits, in the same order; what
// the scans' noise adds to the spread is taken off it, but for as much of the arm as so few scans could have hidden in it. INVALID_ARGUMENT
// for fewer than five displacements or what is not finite.
absl::StatusOr<ArmSpread> ArmSpreadOf(const std::vector<ArmDisplacement>& displacements,
                                      const Vector6d& displacement_sigma);

}  // namespace sixpoint::metrology
