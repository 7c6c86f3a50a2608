// The axis of a hole from the wall of its bore, where a scanner sees into it (docs/methods/inspection.md, bore).
#pragma once

#include <string>

#include "metrology/frames/pose.h"
#include "metrology/inspection/hole_regions.h"
#include "metrology/inspection/pin.h"

namespace sixpoint::metrology {

// What must be seen of a bore, beside what PinLimits asks of any cylinder.
struct BoreLimits {
  double narrowest_mm = 0.5;  // a scanner does not see into a hole that is no wider
  int least_point_count = 200;
  double least_height_ratio = 0.3;  // of the wall seen, over the hole's diameter
  double inside_mm = 0.15;          // under the CAD's surface: the mouth's edge is not the wall
  double above_floor_mm = 0.2;      // of the hole as drawn
  int greatest_point_count_above =
      30;  // above the surface over the hole: more are a pin or a chip, and what hides under it nobody saw
};

// In which the wall's points must lie, as far as drawn; within reach_mm of the widest that a hole may be.
HoleRegion BoreRegionOf(const NominalPin& hole, double reach_mm, const PinLimits& pin, const BoreLimits& limits);

// Points inside the CAD's surface, within the region. A pin's certificate and play say nothing of a bore.
PinFit FitBore(const NominalPin& hole, const Points& points_in_part_mm, const PinLimits& pin, const BoreLimits& limits);

}  // namespace sixpoint::metrology
