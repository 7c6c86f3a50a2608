#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

Points MachineFromSensor(const LineScan& scan, const SensorPose& sensor) {
  Points mapped;
  mapped.reserve(scan.points_mm.size());
  for (const Eigen::Vector3d& p : scan.points_mm) mapped.push_back(sensor.MachineFromSensor(p, scan.v0_mm));
  return mapped;
}

PointSensitivity ZeroPointSensitivity(const Eigen::Vector3d& sensor_mm, const Eigen::Vector3d& zero_mm, double a_rad,
                                      double b_rad, const SensorPose& sensor, const RotaryAxes& axes) {
  const Eigen::Matrix3d zero_from_machine = axes.MachineFromZero(a_rad, b_rad).linear().transpose();
  PointSensitivity sensitivity;
  sensitivity << zero_from_machine * sensor.ParameterJacobian(sensor_mm),
      -zero_from_machine * axes.ParameterJacobian(zero_mm, a_rad, b_rad),
      zero_from_machine * sensor.FieldJacobian(sensor_mm);
  return sensitivity;
}

}  // namespace sixpoint::metrology
