// Sensor to machine from scans of the artefact at two heights and its touch data
// (docs/methods/sensor_calibration.md; CONF 3.4).
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "metrology/calibration/artefact.h"
#include "metrology/calibration/feature_centres.h"
#include "metrology/calibration/probing_noise.h"
#include "metrology/calibration/residual_judgement.h"
#include "metrology/frames/pose.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

// Laser minus touch at a feature's centre, machine frame.
struct CentreResidual {
  std::string scan;
  std::string feature;
  Eigen::Vector3d laser_minus_touch_mm = Eigen::Vector3d::Zero();
};

struct SensorCalibrationOptions {
  LineSensorOptics optics;
  ScannerField field = {};
  // Along each axis, of a cone's centre as it is touched against the same as it is scanned; it takes part in the covariance alone.
  double centre_standard_uncertainty_mm = 0;
  // Root mean square of the scanner's field, as stated of it: the field is then looked for (JOINT), and what is found is taken off every
  // reading (sensor.measured_field). 0: it is not.
  double field_standard_uncertainty_mm = 0;
  // Root mean square of the artefact's upper face about a plane; 0: kFlatnessMm.
  double flatness_standard_uncertainty_mm = 0;
  int threads = 1;  // the result has the same bits for any number
  // Asked between iterations; false stops with CANCELLED.
  std::function<bool()> keep_going;
};

struct SensorCalibration {
  SensorPose sensor;
  CardanAngles angles;             // of sensor.rotation
  CardanAngles angle_uncertainty;  // standard, rad
  Eigen::Isometry3d machine_from_artefact = NotYet<Eigen::Isometry3d>();
  double noise_mm = 0;              // of one laser reading along its ray, from the residuals
  double residual_rms_mm = 0;       // of the laser points, normal to their faces (SEQUENTIAL: of the cone centres)
  double touch_rms_mm = 0;          // of the touched coordinates about the fit, for its degrees of freedom
  double touch_uncertainty_mm = 0;  // of one touched coordinate, as used
  // Of the information matrix of the six parameters, an angle counted as its effect at 10 mm.
  double condition_number = 0;
  std::optional<FieldResponse> field_response;  // where options.field is one; of JOINT
  int iterations = 0;
  bool converged = false;
  std::size_t points_used = 0;
  std::vector<CentreResidual> fitted;  // cones
  std::vector<CentreResidual> check;   // slots, which take no part in the fit
  // Of the slots, along the artefact's face; where several scans show how well they are seen.
  std::optional<ResidualJudgement> judgement;
};

// One weighted least squares over all raw points on the upper face and the cones' walls of all scans and all touched
// points: six parameters of the sensor, six of the artefact's pose. A reading weighs by its noise along the ray, which is
// estimated from the residuals; points near edges take no part, and points off by more than four sigma none either.
//
// INVALID_ARGUMENT for bad touch data or artefact; FAILED_PRECONDITION where the data do not determine a parameter
// (naming it, with what would cure it), a feature is not found, or scans, record and touch data contradict one another.
absl::StatusOr<SensorCalibration> CalibrateSensor(const std::vector<LineScan>& scans, const Artefact& artefact,
                                                  const ArtefactTouch& touch, const SensorCalibrationOptions& options);

// The paper's sequence: alpha and gamma from C2 and C3, beta from the displacement between two heights, compensate,
// repeat (CONF 12, 14); T_sm from the mean of the cones. Cones are taken by the names C1, C2, C3.
absl::StatusOr<SensorCalibration> CalibrateSensorSequentially(const std::vector<LineScan>& scans,
                                                              const Artefact& artefact, const ArtefactTouch& touch,
                                                              const SensorCalibrationOptions& options);

// What both methods begin with: the artefact found in every scan, and the sensor's pose to about 0.3 deg and 0.1 mm.
struct SensorStart {
  SensorPose sensor;
  std::vector<Eigen::Isometry3d> sensor_from_artefact;  // of each scan
};
absl::StatusOr<SensorStart> StartSensor(const std::vector<LineScan>& scans, const Artefact& artefact,
                                        const ArtefactTouch& touch);

// Of a touched coordinate: as stated or, where nothing was, the usual one; more where the residuals show more.
ProbingNoise TouchNoise(const ArtefactTouch& touch, double residual_squares_mm2, double freedom);

// Standard uncertainties of alpha, beta, gamma (rad) from the covariance of the rotation vector in machine axes.
CardanAngles CardanUncertainty(const CardanAngles& angles, const Eigen::Matrix3d& rotation_vector_covariance);

// Condition number of a 6 x 6 covariance with angles counted as their effect at 10 mm.
double ConditionNumber(const Matrix6d& covariance);

// Laser minus touch of all features, into fitted (cones) and check (slots).
absl::Status ReportCentres(const std::vector<LineScan>& scans, const Artefact& artefact, const ArtefactTouch& touch,
                           const SensorCalibrationOptions& options, SensorCalibration* result);

}  // namespace sixpoint::metrology
