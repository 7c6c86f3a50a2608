// What an arm repeats: scans of the artefact, the arm swung away and back in between (CONF 3.3.3).
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <string>
#include <vector>

#include "metrology/calibration/artefact.h"
#include "metrology/calibration/feature_centres.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

struct ArmStudyOptions {
  // Rotation and t_sm only. Identity: displacements in the sensor's axes; the shear of a sensor that is turned by tenths of
  // a degree is the same in all scans and drops out of the differences.
  SensorPose sensor;
  LineSensorOptics optics;
  std::function<bool()> keep_going;  // asked between scans; false stops with CANCELLED
};

// Of the artefact as one scan shows it, against the first scan: its origin's displacement, and R = Rz(dgamma) Ry(dbeta)
// Rx(dalpha) about it; machine axes (those of options.sensor).
struct ArmDisplacement {
  std::string scan;
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
  CardanAngles angles;
  // Of both fits: rotation vector (rad), translation (mm).
  Matrix6d covariance = Matrix6d::Zero();
  double residual_rms_mm = 0;  // along the rays
};

// One pose of the artefact for each scan by least squares over its upper face and its cones, readings weighed along their
// rays, those beyond five sigma left out. The first displacement is zero. INVALID_ARGUMENT for fewer than five scans or
// points that are not finite; FAILED_PRECONDITION where the artefact is not found in a scan or its fit does not settle.
absl::StatusOr<std::vector<ArmDisplacement>> StudyArm(const std::vector<LineScan>& scans, const Artefact& artefact,
                                                      const ArmStudyOptions& options);

inline constexpr int kFewestArmScans = 5;

}  // namespace sixpoint::metrology
