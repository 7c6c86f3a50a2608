// The root of a variance.
#pragma once

#include <cmath>

namespace sixpoint::metrology {

// What rounding left below zero is zero. NaN stays NaN: std::max(0.0, NaN) is 0, which would pass for what is exactly known.
inline double StandardDeviation(double variance) { return std::sqrt(variance < 0 ? 0 : variance); }

}  // namespace sixpoint::metrology
