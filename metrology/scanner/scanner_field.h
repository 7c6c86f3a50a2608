// What a line scanner's readings are off by, smoothly over its measuring field (docs/methods/uncertainty.md, error sources).
#pragma once

#include <Eigen/Core>

#include "metrology/kinematics/calibration_parameters.h"

namespace sixpoint::metrology {

// The measuring field about the sensor frame's origin; none by default, and then no reading is off.
struct ScannerField {
  double half_width_mm = 0;  // along y
  double half_range_mm = 0;  // along z

  // Of optics as a data sheet has them: as wide as the line is where it is longest.
  static ScannerField Of(double mid_range_mm, double range_mm, double line_angle_rad);

  // How far a reading at (y, z) is off along z per field parameter, in the order of kFieldParameters. Over the field each term's mean
  // square is 1, and the terms are orthogonal; a reading beyond it counts as one on its border.
  Eigen::Matrix<double, 1, kFieldParameterCount> TermsAt(double y_mm, double z_mm) const;
};

}  // namespace sixpoint::metrology
