#include "metrology/registration/scan_portion.h"

#include <algorithm>

namespace sixpoint::metrology {

CalibrationCovariance CovarianceOf(const MachineCalibration& calibration) {
  CalibrationCovariance covariance = CalibrationCovariance::Zero();
  covariance.topLeftCorner<6, 6>() = calibration.sensor.covariance;
  covariance.bottomRightCorner<8, 8>() = calibration.axes_covariance;
  return covariance;
}

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

ScanPortion Thin(const LineScan& scan, const MachineCalibration& calibration, const Thinning& thinning) {
  ScanPortion portion;
  portion.id = scan.id;
  portion.commanded_a_rad = scan.a_rad;
  portion.commanded_b_rad = scan.b_rad;
  portion.a_rad = calibration.positioning.a.Reached(scan.a_rad);
  portion.b_rad = calibration.positioning.b.Reached(scan.b_rad);
  const auto count = static_cast<std::int64_t>(scan.points_mm.size());
  const std::int64_t target = std::max<std::int64_t>(1, thinning.target_count);
  std::int64_t stride = (count + target - 1) / target;
  // Profiles have an even number of columns, often a multiple of 5: such a stride would keep whole columns.
  if (stride > 1)
    while (stride % 2 == 0 || stride % 5 == 0) ++stride;
  const Eigen::Isometry3d zero_from_machine =
      calibration.axes.MachineFromZero(portion.a_rad, portion.b_rad).inverse(Eigen::Isometry);
  const double radius_squared = thinning.dense_radius_mm * thinning.dense_radius_mm;
  portion.zero_from_sensor = SensorMapping(zero_from_machine, calibration.sensor, scan.v0_mm);
  portion.sensor.reserve(static_cast<std::size_t>(stride > 0 ? count / stride + 1 : 0));
  for (std::int64_t i = 0, finite = 0; i < count; ++i) {
    const Eigen::Vector3d& p = scan.points_mm[static_cast<std::size_t>(i)];
    if (!p.allFinite()) continue;
    const bool kept = finite++ % stride == 0;
    if (!kept && thinning.dense_places_mm.empty()) continue;
    if (kept && !portion.sensor.Add(p)) ++portion.out_of_reach_count;
    if (thinning.dense_places_mm.empty()) continue;
    const Eigen::Vector3d zero = portion.zero_from_sensor * p;
    for (const Eigen::Vector3d& place : thinning.dense_places_mm) {
      if ((zero - place).squaredNorm() > radius_squared) continue;
      portion.dense_sensor_mm.push_back(p);
      portion.dense_zero_mm.push_back(zero);
      break;
    }
  }
  portion.scan_point_count = count;
  return portion;
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
