// Triangles among which the nearest of some points is, listed so that few of them need be looked at.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "metrology/nearest/near_lanes.h"

namespace sixpoint::metrology {

constexpr std::uint32_t kCandidateGroup = 4;

struct Candidates {
  Eigen::Vector3d centre;  // about which points are measured
  float width_mm;          // no query is farther from it
  const std::uint32_t*
      items;  // of the tree, about from near to far, in groups (the last filled up with the first item)
  const float* group_distance;  // from the centre to the nearest of each group and those after it
  std::uint32_t group_count;
};

// How far off a distance to it in single precision may be, of points up to width_mm from where its corner is counted from.
float ToleranceOf(const TriangleShape& shape, const Eigen::Vector3f& corner_mm, float width_mm);

// Of a triangle with its first corner at the origin.
TriangleShape ShapeOf(const Eigen::Vector3d& ab, const Eigen::Vector3d& ac);

}  // namespace sixpoint::metrology
