#include "metrology/registration/mapping_sensitivity.h"

namespace sixpoint::metrology {

void AddSensitivity(const Eigen::VectorXd& acts, const Eigen::Vector3d& normal, const MappedPoint& point,
                    const std::vector<ScanPortion>& portions, const MachineCalibration& calibration,
                    MappingSensitivity* sensitivity) {
  const ScanPortion& portion = portions[point.portion];
  const Eigen::Matrix<double, 1, kCalibrationParameterCount> by_calibration =
      normal.transpose() * ZeroPointSensitivity(point.sensor_mm, point.zero_mm, portion.a_rad, portion.b_rad,
                                                calibration.sensor, calibration.axes);
  const Eigen::RowVector2d by_angles =
      normal.transpose() * ZeroPointAngleSensitivity(point.zero_mm, portion.a_rad, portion.b_rad, calibration.axes);
  sensitivity->leftCols<kCalibrationParameterCount>() += acts * by_calibration;
  sensitivity->middleCols<2>(MappingParameterCount(point.portion)) += acts * by_angles;
}

}  // namespace sixpoint::metrology
