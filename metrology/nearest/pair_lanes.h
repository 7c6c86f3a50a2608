// Points and triangles side by side, each point with a triangle of its own: how near it is, in double precision. TakeNearer
// (nearest_triangle.h) to the bit, in every width of vectors.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "metrology/frames/pose.h"
#include "metrology/nearest/nearest_triangle.h"
#include "metrology/parallel/lane_width.h"
#include "metrology/parallel/lanes.h"

namespace sixpoint::metrology {

struct PairLanes {
  LaneRow query[3], corner_0[3], corner_1[3], corner_2[3];
  // Found: barycentric coordinates 1 and 2, the part as a number, and the squared distance.
  LaneRow v, w, part, distance_squared;

  void Set(std::size_t lane, const Eigen::Vector3d& point, const Points& vertices, const IndexedTriangle& item);
  // As TakeNearer leaves it, where the item was the lane's.
  NearestTriangle Found(std::size_t lane, const IndexedTriangle& item) const;
};

// Of the first `count` lanes, and of some beyond.
using MeasurePairs = void (*)(std::size_t count, PairLanes* lanes);
MeasurePairs MeasurePairsOf(LaneWidth width);

}  // namespace sixpoint::metrology
