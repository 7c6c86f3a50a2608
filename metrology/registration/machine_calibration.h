// The calibrations in force, with what is known of their errors.
#pragma once

#include <absl/status/status.h>

#include <limits>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/kinematics/axis_positioning.h"
#include "metrology/kinematics/calibration_parameters.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/scanner/line_scanner.h"
#include "metrology/uncertainty/error_source.h"

namespace sixpoint::metrology {

struct MachineCalibration {
  SensorPose sensor;
  RotaryAxes axes;
  AxesCovariance axes_covariance = NotYet<AxesCovariance>();
  RotaryPositioning positioning = {};     // its tables are applied to the angles of scans
  std::vector<ErrorSource> further = {};  // beside what the two calibrations say of their own noise
  std::string sensor_name = {}, axes_name = {};
  double axes_degrees_of_freedom = std::numeric_limits<double>::infinity();  // of axes_covariance

  // As SensorPose's; also of scans that stand at zero already.
  static MachineCalibration Exact() {
    MachineCalibration calibration;
    calibration.sensor = SensorPose::Exact();
    calibration.axes_covariance.setZero();
    return calibration;
  }
};

// INVALID_ARGUMENT: a covariance that is no number was never computed.
absl::Status CheckCovariances(const MachineCalibration& calibration);
// What the two calibrations' own noise is, and all further ones.
std::vector<ErrorSource> SourcesOf(const MachineCalibration& calibration);
CalibrationCovariance CovarianceOf(const MachineCalibration& calibration);

}  // namespace sixpoint::metrology
