// Builds the nodes of a triangle tree (triangle_tree.h).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "metrology/nearest/nearest_triangle.h"

namespace sixpoint::metrology {

// Bounds of four children, by coordinate; a child is a node, or a run of items where its count is not 0.
struct alignas(16) TreeNode {
  static constexpr std::uint32_t kNoChild = 0xffffffff;
  Eigen::Array4f low[3], high[3];
  std::uint32_t first[4];
  std::uint32_t count[4];
  EIGEN_MAKE_ALIGNED_OPERATOR_NEW
};

struct BuiltTree {
  std::vector<IndexedTriangle> items;  // in the tree's own order, in which neighbours stand near each other
  std::vector<TreeNode, Eigen::aligned_allocator<TreeNode>> nodes;  // the first is the root; none for no items
};

// Triangles without area are left out. Boxes are kept in float, wider than what it rounds.
BuiltTree BuildTree(const Points& vertices, const std::vector<TriangleCorners>& triangles);

}  // namespace sixpoint::metrology
