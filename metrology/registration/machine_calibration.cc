#include "metrology/registration/machine_calibration.h"

namespace sixpoint::metrology {

CalibrationCovariance CovarianceOf(const MachineCalibration& calibration) {
  return JointCovariance(calibration.sensor.covariance, calibration.axes_covariance);
}

PointSensitivity ZeroPointSensitivity(const Eigen::Vector3d& sensor_mm, const Eigen::Vector3d& zero_mm, double a_rad,
                                      double b_rad, const MachineCalibration& calibration) {
  const Eigen::Matrix3d zero_from_machine = calibration.axes.MachineFromZero(a_rad, b_rad).linear().transpose();
  PointSensitivity sensitivity;
  sensitivity << zero_from_machine * calibration.sensor.ParameterJacobian(sensor_mm),
      -zero_from_machine * calibration.axes.ParameterJacobian(zero_mm, a_rad, b_rad);
  return sensitivity;
}

}  // namespace sixpoint::metrology
