// Points that stand together, by PCL's Euclidean clusters.
#pragma once

#include <cstddef>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// Indices of the largest set of points of which each has another within gap_mm, in rising order; empty beyond 50,000 points
// or two million pairs within cubes of that side, where the search would take seconds, and of points that are not finite.
// Deterministic.
std::vector<std::size_t> LargestCluster(const Points& points_mm, double gap_mm);

}  // namespace sixpoint::metrology
