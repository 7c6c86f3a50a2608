// A cubic patch as plain numbers, and what is computed of them. Number is a double, or several side by side, one patch each
// (surface/foot_lanes.cc): all is done in one order, so that each of them comes to the bits of a double.
#pragma once

#include "metrology/parallel/lanes.h"

namespace sixpoint::metrology {

template <typename Number>
struct PatchNumbers {
  Number corner_mm[3], unit_normal[3];
  Number dual_1[3], dual_2[3];  // barycentric coordinates 1 and 2 of x: dual . (x - corner)
  Number edge_1_mm[3], edge_2_mm[3];
  Number height_mm[7];  // Bezier: 001 011 | 112 122 | 220 200 pairs, then the middle
};

template <typename Number>
struct PatchPoint {
  Number point_mm[3], normal[3];  // the normal not yet of unit length
};

// At barycentric coordinates of the plane, outside the triangle too.
template <typename Number>
SIXPOINT_INLINE PatchPoint<Number> PointOf(const PatchNumbers<Number>& patch, const Number (&barycentric)[3]) {
  const Number b0 = barycentric[0], b1 = barycentric[1], b2 = barycentric[2];
  const Number(&h)[7] = patch.height_mm;
  const Number d0 =
      3. * (2. * b0 * b1 * h[0] + b1 * b1 * h[1] + b2 * b2 * h[4] + 2. * b0 * b2 * h[5] + 2. * b1 * b2 * h[6]);
  const Number d1 =
      3. * (b0 * b0 * h[0] + 2. * b0 * b1 * h[1] + 2. * b1 * b2 * h[2] + b2 * b2 * h[3] + 2. * b0 * b2 * h[6]);
  const Number d2 =
      3. * (b1 * b1 * h[2] + 2. * b1 * b2 * h[3] + 2. * b2 * b0 * h[4] + b0 * b0 * h[5] + 2. * b0 * b1 * h[6]);
  const Number slope_1 = d1 - d0, slope_2 = d2 - d0;
  const Number height_mm = 3. * (b0 * b0 * b1 * h[0] + b0 * b1 * b1 * h[1] + b1 * b1 * b2 * h[2] + b1 * b2 * b2 * h[3] +
                                 b2 * b2 * b0 * h[4] + b2 * b0 * b0 * h[5] + 2. * b0 * b1 * b2 * h[6]);
  PatchPoint<Number> at;
  for (int k = 0; k < 3; ++k) {
    at.point_mm[k] =
        patch.corner_mm[k] + b1 * patch.edge_1_mm[k] + b2 * patch.edge_2_mm[k] + height_mm * patch.unit_normal[k];
    at.normal[k] = patch.unit_normal[k] - slope_1 * patch.dual_1[k] - slope_2 * patch.dual_2[k];
  }
  return at;
}

// By how much barycentric coordinates change over a step.
template <typename Number>
SIXPOINT_INLINE void StepOf(const PatchNumbers<Number>& patch, const Number (&by_mm)[3], Number (&step)[3]) {
  step[1] = Product(patch.dual_1, by_mm);
  step[2] = Product(patch.dual_2, by_mm);
  step[0] = -step[1] - step[2];
}

}  // namespace sixpoint::metrology
