// The calibrations in force, with what is known of their errors.
#pragma once

#include "metrology/kinematics/axis_positioning.h"
#include "metrology/kinematics/calibration_parameters.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

struct MachineCalibration {
  SensorPose sensor;
  RotaryAxes axes;
  AxesCovariance axes_covariance = AxesCovariance::Zero();
  RotaryPositioning positioning = {};  // its tables are applied to the angles of scans
};

CalibrationCovariance CovarianceOf(const MachineCalibration& calibration);

// Change of a scan point at A = B = 0 per calibration parameter.
PointSensitivity ZeroPointSensitivity(const Eigen::Vector3d& sensor_mm, const Eigen::Vector3d& zero_mm, double a_rad,
                                      double b_rad, const MachineCalibration& calibration);

}  // namespace sixpoint::metrology
