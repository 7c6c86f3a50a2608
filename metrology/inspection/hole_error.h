// Position and inclination of a drilled hole against its nominal, with uncertainties, from the pin's axis
// (docs/methods/inspection.md, hole).
#pragma once

#include <Eigen/Core>

#include "metrology/inspection/pin.h"

namespace sixpoint::metrology {

struct HoleError {
  Eigen::Vector3d start_in_part_mm = Eigen::Vector3d::Zero();  // where the axis meets the surface
  Eigen::Vector3d axis_in_part = Eigen::Vector3d::UnitZ();     // unit, out of the part
  double position_mm = 0;                                      // distance of the start from the nominal start
  double inclination_rad = 0;                                  // angle of the axis with the nominal axis
  double position_standard_uncertainty_mm = 0;
  double inclination_standard_uncertainty_rad = 0;
  // By which a standard uncertainty is expanded to 95 %: 1.96, but near zero error.
  double position_coverage_factor = 1.96, inclination_coverage_factor = 1.96;
  // How the position follows the fit's parameters: that of which position_standard_uncertainty_mm is the uncertainty.
  Eigen::Matrix<double, 1, 5> position_per_parameter = Eigen::Matrix<double, 1, 5>::Zero();
  Eigen::Matrix<double, 3, 5> start_per_parameter = Eigen::Matrix<double, 3, 5>::Zero();  // the start does
};

// The surface is taken as its tangent plane at the nominal start: over a displacement of 0.1 mm on a radius of 3 mm they
// differ by under 2 um in height, so by less than the axis's slope to the normal of that along the surface.
// covariance: of the fit's parameters (c1, c2, s1, s2, radius), from everything. Near zero error, where a length is not
// linear in its components, the greatest standard deviation of its components is given, and the expanded uncertainty reaches down to no error
// at all, as far as the quantile of an error's length (distance_quantile.h) does.
HoleError HoleErrorOf(const NominalPin& nominal, const PinFit& fit, const Eigen::Matrix<double, 5, 5>& covariance);

}  // namespace sixpoint::metrology
