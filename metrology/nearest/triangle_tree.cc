#include "metrology/nearest/triangle_tree.h"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace sixpoint::metrology {
namespace {

constexpr int kStackSize = 512;

// Of a box, which may be a point, from the boxes of the children.
inline Eigen::Array4f SquaredDistances(const TreeNode& node, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  Eigen::Array4f squared = Eigen::Array4f::Zero();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Array4f outside = (node.low[k] - high[k]).max(low[k] - node.high[k]).max(0.f);
    squared += outside * outside;
  }
  return squared;
}

// A line from one point to another, for many boxes.
struct Segment {
  Segment(const Eigen::Vector3d& start, const Eigen::Vector3d& end) : from(start), along(end - start) {
    // So steep that no box has a NaN.
    constexpr double kNone = 1e-300;
    for (int k = 0; k < 3; ++k) inverse[k] = 1 / (std::abs(along[k]) < kNone ? kNone : along[k]);
  }

  // For each child whether its box is met.
  Eigen::Array<bool, 4, 1> Enters(const TreeNode& node) const {
    Eigen::Array4d near = Eigen::Array4d::Zero(), far = Eigen::Array4d::Ones();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Array4d low = (node.low[k].cast<double>() - from[k]) * inverse[k];
      const Eigen::Array4d high = (node.high[k].cast<double>() - from[k]) * inverse[k];
      near = near.max(low.min(high));
      far = far.min(low.max(high));
    }
    return near <= far + 1e-12;
  }

  // Moeller and Trumbore. A line along an edge must meet one of its two triangles: both are wider by a part in 1e9.
  bool Meets(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) const {
    constexpr double kEdge = 1e-9;
    const Eigen::Vector3d ab = b - a, ac = c - a, p = along.cross(ac);
    const double determinant = ab.dot(p);
    if (determinant == 0) return false;
    const Eigen::Vector3d s = from - a, q = s.cross(ab);
    const double u = s.dot(p) / determinant, v = along.dot(q) / determinant, t = ac.dot(q) / determinant;
    return u >= -kEdge && v >= -kEdge && u + v <= 1 + kEdge && t >= 0 && t <= 1;
  }

  Eigen::Vector3d from, along, inverse;
};

}  // namespace

TriangleTree::TriangleTree(const Points& vertices, const std::vector<TriangleCorners>& triangles)
    : vertices_(vertices), tree_(BuildTree(vertices, triangles)) {
  if (empty()) return;
  item_of_triangle_.assign(triangles.size(), NearestTriangle::kNone);
  for (std::uint32_t i = 0; i < tree_.items.size(); ++i) item_of_triangle_[tree_.items[i].triangle] = i;
}

std::size_t TriangleTree::memory_bytes() const {
  return tree_.items.capacity() * sizeof(IndexedTriangle) + item_of_triangle_.capacity() * sizeof(std::uint32_t) +
         tree_.nodes.capacity() * sizeof(TreeNode);
}

NearestTriangle TriangleTree::Find(const Eigen::Vector3d& query, double limit_squared, std::uint32_t hint) const {
  NearestTriangle best;
  best.distance_squared = limit_squared;
  if (empty()) return best;
  if (hint < item_of_triangle_.size() && item_of_triangle_[hint] != NearestTriangle::kNone)
    TakeNearer(vertices_, tree_.items[item_of_triangle_[hint]], query, &best);
  const Eigen::Vector3f q = query.cast<float>();
  const auto reach = [&best] {  // above the best distance by more than float rounds
    return static_cast<float>(best.distance_squared * (1 + 1e-5)) + std::numeric_limits<float>::min();
  };
  struct Waiting {
    float distance_squared;
    std::uint32_t node;
  };
  std::array<Waiting, kStackSize> stack;
  int depth = 0;
  stack[depth++] = {0, 0};
  float limit = reach();
  while (depth > 0) {
    const Waiting next = stack[--depth];
    if (next.distance_squared > limit) continue;
    const TreeNode& node = tree_.nodes[next.node];
    const Eigen::Array4f squared = SquaredDistances(node, q, q);
    const int bottom = depth;
    for (int c = 0; c < 4; ++c) {
      if (!(squared[c] <= limit) || node.first[c] == TreeNode::kNoChild) continue;
      if (node.count[c] > 0) {
        for (std::uint32_t i = 0; i < node.count[c]; ++i)
          TakeNearer(vertices_, tree_.items[node.first[c] + i], query, &best);
        limit = reach();
      } else {
        stack[depth++] = {squared[c], node.first[c]};
        for (int i = depth - 1; i > bottom && stack[i].distance_squared > stack[i - 1].distance_squared; --i)
          std::swap(stack[i], stack[i - 1]);
      }
    }
  }
  return best;
}

void TriangleTree::FindEach(const Eigen::Vector3d* queries, std::size_t count, double limit_squared, std::uint32_t hint,
                            NearestTriangle* nearest) const {
  for (std::size_t i = 0; i < count; ++i) {
    nearest[i] = Find(queries[i], limit_squared, hint);
    if (nearest[i].triangle != NearestTriangle::kNone) hint = nearest[i].triangle;
  }
}

void TriangleTree::FindAbout(const Eigen::AlignedBox3d& box, double distance, std::vector<std::uint32_t>* items) const {
  items->clear();
  if (empty()) return;
  const Eigen::Vector3f low = box.min().cast<float>(), high = box.max().cast<float>();
  const auto limit = static_cast<float>(distance * distance * (1 + 1e-5)) + std::numeric_limits<float>::min();
  std::array<std::uint32_t, kStackSize> stack;
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const TreeNode& node = tree_.nodes[stack[--depth]];
    const Eigen::Array4f squared = SquaredDistances(node, low, high);
    for (int c = 0; c < 4; ++c) {
      if (!(squared[c] <= limit) || node.first[c] == TreeNode::kNoChild) continue;
      if (node.count[c] == 0)
        stack[depth++] = node.first[c];
      else
        for (std::uint32_t i = 0; i < node.count[c]; ++i) items->push_back(node.first[c] + i);
    }
  }
}

bool TriangleTree::Meets(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  if (empty()) return false;
  const Segment segment(from, to);
  std::array<std::uint32_t, kStackSize> stack;
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const TreeNode& node = tree_.nodes[stack[--depth]];
    const auto enters = segment.Enters(node);
    for (int c = 0; c < 4; ++c) {
      if (!enters[c] || node.first[c] == TreeNode::kNoChild) continue;
      if (node.count[c] == 0) {
        stack[depth++] = node.first[c];
        continue;
      }
      for (std::uint32_t i = node.first[c]; i < node.first[c] + node.count[c]; ++i) {
        const TriangleCorners& corners = tree_.items[i].corners;
        if (segment.Meets(vertices_[corners[0]], vertices_[corners[1]], vertices_[corners[2]])) return true;
      }
    }
  }
  return false;
}

}  // namespace sixpoint::metrology
