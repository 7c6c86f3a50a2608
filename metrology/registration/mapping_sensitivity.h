// How what a fit finds follows what maps its scans: the calibration parameters, and of each scan the angles it was taken at.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "metrology/registration/scan_portion.h"

namespace sixpoint::metrology {

// Columns: the calibration parameters, then of each portion in turn its a and its b (per radian taken greater).
using MappingSensitivity = Eigen::MatrixXd;

inline Eigen::Index MappingParameterCount(std::size_t portion_count) {
  return kCalibrationParameterCount + 2 * static_cast<Eigen::Index>(portion_count);
}

// A point of a portion: where the sensor read it, and at zero.
struct MappedPoint {
  std::size_t portion = 0;
  Eigen::Vector3d sensor_mm, zero_mm;
};

// Adds what one point does to the values that follow its distance along `normal` (at zero) by `acts`.
void AddSensitivity(const Eigen::VectorXd& acts, const Eigen::Vector3d& normal, const MappedPoint& point,
                    const std::vector<ScanPortion>& portions, const MachineCalibration& calibration,
                    MappingSensitivity* sensitivity);

}  // namespace sixpoint::metrology
