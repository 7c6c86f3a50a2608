// How uncertain one probed coordinate is (docs/methods/uncertainty.md, small numbers).
#pragma once

#include <limits>

namespace sixpoint::metrology {

struct ProbingNoise {
  double standard_uncertainty_mm = 0;
  double degrees_of_freedom = std::numeric_limits<double>::infinity();  // where it was seen, not stated
};

// As stated, or as the residuals show where that is more, or nothing was stated (0). Never less than what was stated: a few residuals that
// happen to be small say nothing against a certificate.
ProbingNoise ProbingNoiseOf(double residual_squares_mm2, double degrees_of_freedom, double stated_mm);

}  // namespace sixpoint::metrology
