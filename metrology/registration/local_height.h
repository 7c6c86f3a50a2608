// The scanned surface's height over the CAD at one place, from the points around it.
#pragma once

#include <cstdint>
#include <vector>

#include "metrology/registration/mapping_sensitivity.h"
#include "metrology/registration/scan_portion.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

inline constexpr std::int64_t kLeastLocalPoints = 30;  // of which a height is made, within 1 mm

struct LocalHeight {
  double height_mm = 0;
  double standard_uncertainty_mm = 0;
  std::int64_t point_count = 0;    // below kLeastLocalPoints there is no height
  Eigen::Vector3d normal;          // of the CAD, at zero
  MappingSensitivity sensitivity;  // of the height: one row
};

// Robust quadratic fit of the deviation from the CAD around a point of the surface (part frame, with its unit normal); its
// value and uncertainty at the point itself. The loss never gets narrower than floor_mm.
LocalHeight HeightAt(const Surface& surface, const std::vector<ScanPortion>& portions, const Eigen::Vector3d& point_mm,
                     const Eigen::Vector3d& normal, const Eigen::Isometry3d& zero_from_part,
                     const MachineCalibration& calibration, double floor_mm);

}  // namespace sixpoint::metrology
