#include "metrology/registration/mapping_sensitivity.h"

namespace sixpoint::metrology {

Eigen::Matrix<double, 1, kCalibrationParameterCount> ByCalibration(const Eigen::Vector3d& normal,
                                                                   const MappedPoint& point,
                                                                   const std::vector<ScanPortion>& portions,
                                                                   const MachineCalibration& calibration) {
  const ScanPortion& portion = portions[point.portion];
  return normal.transpose() * ZeroPointSensitivity(point.sensor_mm, point.zero_mm, portion.a_rad, portion.b_rad,
                                                   calibration.sensor, calibration.axes);
}

void AddSensitivity(const Eigen::VectorXd& acts, const Eigen::Vector3d& normal, const MappedPoint& point,
                    const std::vector<ScanPortion>& portions, const MachineCalibration& calibration,
                    MappingSensitivity* sensitivity) {
  const ScanPortion& portion = portions[point.portion];
  const Eigen::RowVector2d by_angles =
      normal.transpose() * ZeroPointAngleSensitivity(point.zero_mm, portion.a_rad, portion.b_rad, calibration.axes);
  sensitivity->leftCols<kCalibrationParameterCount>() += acts * ByCalibration(normal, point, portions, calibration);
  sensitivity->middleCols<2>(MappingParameterCount(point.portion)) += acts * by_angles;
}

}  // namespace sixpoint::metrology
