#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

Points MachineFromSensor(const LineScan& scan, const SensorPose& sensor) {
  Points mapped;
  mapped.reserve(scan.points_mm.size());
  for (const Eigen::Vector3d& p : scan.points_mm) mapped.push_back(sensor.MachineFromSensor(p, scan.v0_mm));
  return mapped;
}

Points ZeroFromSensor(const LineScan& scan, const SensorPose& sensor, const RotaryAxes& axes) {
  const Eigen::Isometry3d zero_from_machine = axes.MachineFromZero(scan.a_rad, scan.b_rad).inverse();
  Points mapped = MachineFromSensor(scan, sensor);
  for (Eigen::Vector3d& p : mapped) p = zero_from_machine * p;
  return mapped;
}

}  // namespace sixpoint::metrology
