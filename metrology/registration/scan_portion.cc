#include "metrology/registration/scan_portion.h"

#include <algorithm>

namespace sixpoint::metrology {

CalibrationCovariance CovarianceOf(const MachineCalibration& calibration) {
  CalibrationCovariance covariance = CalibrationCovariance::Zero();
  covariance.topLeftCorner<6, 6>() = calibration.sensor.covariance;
  covariance.bottomRightCorner<8, 8>() = calibration.axes_covariance;
  return covariance;
}

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
  portion.sensor_mm.reserve(static_cast<std::size_t>(stride > 0 ? count / stride + 1 : 0));
  portion.zero_mm.reserve(portion.sensor_mm.capacity());
  for (std::int64_t i = 0, finite = 0; i < count; ++i) {
    const Eigen::Vector3d& p = scan.points_mm[static_cast<std::size_t>(i)];
    if (!p.allFinite()) continue;
    const bool kept = finite++ % stride == 0;
    if (!kept && thinning.dense_places_mm.empty()) continue;
    const Eigen::Vector3d zero = zero_from_machine * calibration.sensor.MachineFromSensor(p, scan.v0_mm);
    if (kept) {
      portion.sensor_mm.push_back(p);
      portion.zero_mm.push_back(zero);
    }
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
