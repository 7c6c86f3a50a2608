#include "metrology/scanner/line_scanner.h"

#include "metrology/kinematics/linear_axes.h"

namespace sixpoint::metrology {

Points MachineFromSensor(const LineScan& scan, const SensorPose& sensor) {
  Points mapped;
  mapped.reserve(scan.points_mm.size());
  for (const Eigen::Vector3d& p : scan.points_mm) mapped.push_back(sensor.MachineFromSensor(p, scan.v0_mm));
  return mapped;
}

PointSensitivity ZeroPointSensitivity(const Eigen::Vector3d& sensor_mm, const Eigen::Vector3d& zero_mm, double a_rad,
                                      double b_rad, const SensorPose& sensor, const RotaryAxes& axes) {
  const Eigen::Isometry3d machine_from_zero = axes.MachineFromZero(a_rad, b_rad);
  const Eigen::Matrix3d zero_from_machine = machine_from_zero.linear().transpose();
  PointSensitivity sensitivity;
  sensitivity << zero_from_machine * sensor.ParameterJacobian(sensor_mm),
      -zero_from_machine * axes.ParameterJacobian(zero_mm, a_rad, b_rad),
      zero_from_machine * sensor.FieldJacobian(sensor_mm),
      zero_from_machine * LinearAxesJacobian(machine_from_zero * zero_mm);
  return sensitivity;
}

Eigen::Matrix<double, 3, 2> ZeroPointAngleSensitivity(const Eigen::Vector3d& zero_mm, double a_rad, double b_rad,
                                                      const RotaryAxes& axes) {
  return -axes.MachineFromZero(a_rad, b_rad).linear().transpose() * axes.AngleJacobian(zero_mm, a_rad, b_rad);
}

}  // namespace sixpoint::metrology
