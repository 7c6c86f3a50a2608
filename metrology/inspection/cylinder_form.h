// What a fitted cylinder leaves of its points beyond noise: a bent pin, a dirty one, a torn bore (docs/methods/inspection.md, form).
#pragma once

#include <Eigen/Core>

#include "metrology/inspection/pin.h"

namespace sixpoint::metrology {

// By means of the residuals over cells of 30 deg and a tenth of the height seen. Positive outward.
struct CylinderForm {
  // Around: of the means over the whole height. Along the generators: of each cell's mean less that of its 30 deg.
  // A range has the noise of its means in it; an rms has not.
  double around_range_um = 0, around_rms_um = 0;
  double along_range_um = 0, along_rms_um = 0;
  double bend_um =
      0;  // how far the axis leaves its chord in the middle of the height seen, where that is more than noise
  bool exceeds_noise = false;
  // Columns of what the cylinder's parameters (c1, c2, s1, s2, radius) are off by it, one standard deviation each; none where it is noise.
  Eigen::Matrix<double, 5, Eigen::Dynamic> per_sigma;
};
CylinderForm FormOf(const PinFit& fit);

}  // namespace sixpoint::metrology
