// Embree's point query over the same triangles: the distance to the nearest, single precision.
#pragma once

#include <vector>

#include "bench/registration/cases.h"

namespace sixpoint::bench {

// Distances, positive on the side that the nearest triangle's normal points to (wrong beyond sharp edges, where two
// triangles are equally near); `seconds` of the queries alone.
std::vector<float> EmbreeDistances(const Blade& blade, const metrology::Points& part_mm, float limit_mm, int threads,
                                   double* seconds);

}  // namespace sixpoint::bench
