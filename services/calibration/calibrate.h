// The work of the calibrations: one kernel each, of what was fetched. Pure.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/calibration/axis_characterisation.h"
#include "metrology/calibration/probe_calibration.h"
#include "metrology/calibration/rotation_calibration.h"
#include "metrology/calibration/sensor_calibration.h"
#include "metrology/studies/arm_mean.h"
#include "services/calibration/inputs.h"
#include "sixpoint/calibration/v1/calibration.pb.h"

namespace sixpoint::calibration {

struct CalibratedSensor {
  metrology::SensorCalibration calibration;
  std::vector<metrology::ArmShare> arm_shares;  // empty: all scans count as of one swing
};
// As it was stated, with what the stated uncertainties make of it.
struct StatedSensor {
  metrology::SensorPose sensor;
  metrology::CardanAngles angles, angle_uncertainty;
};
struct CalibratedProbe {
  metrology::ProbeCalibration calibration;
  std::vector<metrology::ProbeFaceCheck> checks;  // of the block where it was moved to
};

// By the request's method. FAILED_PRECONDITION with a reason: CALIBRATION_UNDETERMINED, CALIBRATION_NOT_CONVERGED. Of scans of several
// series of an arm that was studied the one that sees most heights is calibrated by (then the one with most scans), and the others say where the arm stands on the mean.
absl::StatusOr<CalibratedSensor> Calibrate(const v1::CalibrateSensorRequest& request, const SensorInputs& inputs);
absl::StatusOr<StatedSensor> Calibrate(const v1::StateSensorPoseRequest& request, const StatedInputs& inputs);
absl::StatusOr<metrology::RotationCalibration> Calibrate(const v1::CalibrateRotationRequest& request,
                                                         const RotationInputs& inputs);
absl::StatusOr<CalibratedProbe> Calibrate(const v1::CalibrateProbeRequest& request, const ProbeInputs& inputs);
absl::StatusOr<metrology::AxisCharacterisation> Calibrate(const v1::CharacteriseAxisRequest& request,
                                                          const AxisInputs& inputs);

}  // namespace sixpoint::calibration
