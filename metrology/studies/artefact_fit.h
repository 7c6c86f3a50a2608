// Where the artefact, or the sensor, stands by one scan: least squares of its readings onto the artefact's upper face and cones.
#pragma once

#include <absl/status/statusor.h>

#include "metrology/calibration/artefact.h"
#include "metrology/calibration/feature_centres.h"
#include "metrology/frames/pose.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

struct ArtefactFit {
  SensorPose sensor;  // as it was given, or as it is from where the artefact looks so
  Eigen::Isometry3d machine_from_artefact = NotYet<Eigen::Isometry3d>();
  // Of what was fitted, by the readings' scatter: rotation vector (rad), translation (mm), in machine axes.
  Matrix6d covariance = NotYet<Matrix6d>();
  // The same per field parameter of the scanner (order of kFieldParameters); zero where the sensor has no field.
  FieldResponse field_response = FieldResponse::Zero();
  double residual_rms_mm = 0;  // along the rays
};

// Readings are weighed along their rays, those beyond five sigma left out; a rigid fit of cloud onto cloud would miss dbeta and see half of
// dgamma, for a sensor that turns while the encoder moves along X shears the scan (CONF 12). FAILED_PRECONDITION where the artefact is not
// found in the scan, its points do not determine the pose, or the fit does not settle.

// The artefact, found in the scan; the sensor stands as it is taken to.
absl::StatusOr<ArtefactFit> FitArtefactPose(const LineScan& scan, const Artefact& artefact,
                                            const LineSensorOptics& optics, const SensorPose& sensor);
// Whether it is found there: asked once of a scan, before the sensor is fitted to it.
absl::Status CheckShown(const LineScan& scan, const Artefact& artefact, const SensorPose& sensor);
// The sensor; the artefact stands, and is in the scan. The start is no further off than some tenths of a millimetre.
absl::StatusOr<ArtefactFit> FitSensorPose(const LineScan& scan, const Artefact& artefact,
                                          const LineSensorOptics& optics, const SensorPose& start,
                                          const Eigen::Isometry3d& machine_from_artefact);

}  // namespace sixpoint::metrology
