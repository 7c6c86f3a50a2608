// The way from one shape into another, with two derivatives of 0 at both ends: the Bezier polynomial of the values 0, 0, 0, 1, 1, 1.
#pragma once

#include <algorithm>

namespace sixpoint::metrology {

// 0 below 0, 1 above 1.
inline double SmoothStep(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * t * (10 + t * (6 * t - 15));
}

}  // namespace sixpoint::metrology
