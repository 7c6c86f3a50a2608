// Triangles among which the nearest of some points is, listed so that few of them need be looked at.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "metrology/nearest/near_lanes.h"
#include "metrology/nearest/triangle_tree.h"

namespace sixpoint::metrology {

constexpr std::uint32_t kCandidateGroup = 4;

struct Candidates {
  Eigen::Vector3d centre;       // about which points are measured
  float width_mm;               // no query is farther from it
  const std::uint32_t* items;   // of the tree, nearest to the centre first, in groups (the last one repeated)
  const float* group_distance;  // from the centre to the nearest of each group
  std::uint32_t group_count;
};

// Puts found items in order and adds them as `Candidates` has them. Returns the number of groups.
std::uint32_t ListCandidates(std::vector<TriangleTree::Within>* found, std::vector<std::uint32_t>* items,
                             std::vector<float>* group_distance);

// Of a triangle with its first corner at the origin.
TriangleShape ShapeOf(const Eigen::Vector3d& ab, const Eigen::Vector3d& ac);

}  // namespace sixpoint::metrology
