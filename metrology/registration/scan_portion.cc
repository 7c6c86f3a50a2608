#include "metrology/registration/scan_portion.h"

#include <algorithm>

namespace sixpoint::metrology {

namespace {

// The mapping is affine: its values at the origin and the three unit points say all.
Eigen::Affine3d SensorMapping(const Eigen::Isometry3d& zero_from_machine, const SensorPose& sensor,
                              const Eigen::Vector3d& v0_mm) {
  const Eigen::Vector3d origin = sensor.MachineFromSensor(Eigen::Vector3d::Zero(), v0_mm);
  Eigen::Affine3d machine_from_sensor = Eigen::Affine3d::Identity();
  machine_from_sensor.translation() = origin;
  for (int k = 0; k < 3; ++k)
    machine_from_sensor.linear().col(k) = sensor.MachineFromSensor(Eigen::Vector3d::Unit(k), v0_mm) - origin;
  return zero_from_machine * machine_from_sensor;
}

}  // namespace

Thinner::Thinner(const LineScan& scan, std::int64_t point_count, const MachineCalibration& calibration,
                 const Thinning& thinning)
    : thinning_(thinning), sensor_(calibration.sensor) {
  portion_.id = scan.id;
  portion_.commanded_a_rad = scan.a_rad;
  portion_.commanded_b_rad = scan.b_rad;
  portion_.a_rad = calibration.positioning.a.Reached(scan.a_rad);
  portion_.b_rad = calibration.positioning.b.Reached(scan.b_rad);
  const std::int64_t target = std::max<std::int64_t>(1, thinning.target_count);
  stride_ = std::max<std::int64_t>(1, (point_count + target - 1) / target);
  // Profiles have an even number of columns, often a multiple of 5: such a stride would keep whole columns.
  if (stride_ > 1)
    while (stride_ % 2 == 0 || stride_ % 5 == 0) ++stride_;
  const Eigen::Isometry3d zero_from_machine =
      calibration.axes.MachineFromZero(portion_.a_rad, portion_.b_rad).inverse(Eigen::Isometry);
  portion_.zero_from_sensor =
      calibration.axes.Growth(1 / scan.stretch) * SensorMapping(zero_from_machine, calibration.sensor, scan.v0_mm);
  portion_.sensor.reserve(static_cast<std::size_t>(std::max<std::int64_t>(0, point_count) / stride_ + 1));
}

void Thinner::Add(const Points& points_mm) {
  const double radius_squared = thinning_.dense_radius_mm * thinning_.dense_radius_mm;
  portion_.scan_point_count += static_cast<std::int64_t>(points_mm.size());
  for (const Eigen::Vector3d& reading : points_mm) {
    if (!reading.allFinite()) continue;
    const bool is_kept = finite_count_++ % stride_ == 0;
    if (!is_kept && thinning_.dense_places_mm.empty()) continue;
    const Eigen::Vector3d p = sensor_.WithoutField(reading);
    if (is_kept && !portion_.sensor.Add(p)) ++portion_.out_of_reach_count;
    if (thinning_.dense_places_mm.empty()) continue;
    const Eigen::Vector3d zero = portion_.zero_from_sensor * p;
    for (const Eigen::Vector3d& place : thinning_.dense_places_mm) {
      if ((zero - place).squaredNorm() > radius_squared) continue;
      portion_.dense_sensor_mm.push_back(p);
      portion_.dense_zero_mm.push_back(zero);
      break;
    }
  }
}

ScanPortion Thin(const LineScan& scan, const MachineCalibration& calibration, const Thinning& thinning) {
  Thinner thinner(scan, static_cast<std::int64_t>(scan.points_mm.size()), calibration, thinning);
  thinner.Add(scan.points_mm);
  return thinner.Take();
}

}  // namespace sixpoint::metrology
