// The only weld: which points are one.
#pragma once

#include <cstdint>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// For each point the one that stands for it: itself, or one before it no farther than the tolerance that stands for itself
// (0: equal bit for bit, -0 being 0, and then the first such).
std::vector<std::uint32_t> FirstAlike(double tolerance_mm, const Points& points);

// Points alike become one, in order of first use. Returns the new index of each.
std::vector<std::uint32_t> Weld(double tolerance_mm, Points* points);

}  // namespace sixpoint::metrology
