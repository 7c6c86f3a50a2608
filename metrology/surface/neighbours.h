// Several parts of one kind beside each other: which points are one part's and which a neighbour's, by how far they are from each where it
// stands (docs/methods/registration.md, stations).
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// How far each point is from the part at that pose; infinite beyond the limit.
std::vector<double> DistancesAt(const Eigen::Isometry3d& zero_from_part, const Surface& surface, const Points& zero_mm,
                                double limit_mm, int thread_count);

// Of points, and how far each is from the part itself: whether that is finite and no neighbour is nearer. neighbours: zero_from_part of each.
std::vector<bool> AreOwn(const std::vector<Eigen::Isometry3d>& neighbours, const Surface& surface,
                         const Points& zero_mm, const std::vector<double>& own_mm, double limit_mm, int thread_count);

}  // namespace sixpoint::metrology
