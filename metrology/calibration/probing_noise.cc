#include "metrology/calibration/probing_noise.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {

ProbingNoise ProbingNoiseOf(double residual_squares_mm2, double degrees_of_freedom, double stated_mm) {
  const double freedom = std::max(1.0, degrees_of_freedom);
  const double seen_mm = std::sqrt(residual_squares_mm2 / freedom);
  if (stated_mm > 0 && seen_mm <= stated_mm) return {stated_mm};
  return {seen_mm, freedom};
}

}  // namespace sixpoint::metrology
