#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

Points MachineFromSensor(const LineScan& scan, const SensorPose& sensor) {
  Points mapped;
  mapped.reserve(scan.points_mm.size());
  for (const Eigen::Vector3d& p : scan.points_mm) mapped.push_back(sensor.MachineFromSensor(p, scan.v0_mm));
  return mapped;
}

}  // namespace sixpoint::metrology
