// A four-way bounding-volume tree over triangles that answers nearest-triangle queries exactly.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// Which part of a triangle is nearest: its inside, edge i (opposite corner i) or corner i.
enum class TrianglePart : std::uint8_t { kInside, kEdge0, kEdge1, kEdge2, kCorner0, kCorner1, kCorner2 };

class TriangleTree {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;
  struct Item;
  struct Nearest {
    std::uint32_t triangle = kNone;  // index in the list it was built from
    double distance_squared = std::numeric_limits<double>::infinity();
    Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
    TrianglePart part = TrianglePart::kInside;
    const Item* item = nullptr;  // of the triangle
  };

  // Triangles without area are left out. Vertices should be near their origin (boxes are kept in float, conservatively);
  // they stay where they are while the tree lives.
  TriangleTree(const Points& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles);

  // The nearest triangle within a distance; equal distances go to the smaller index. The hint only saves time.
  Nearest Find(const Eigen::Vector3d& query, double limit_squared, std::uint32_t hint) const;

  // The same of each in turn, from one to the next.
  void FindEach(const Eigen::Vector3d* queries, std::size_t count, double limit_squared, std::uint32_t hint,
                Nearest* nearest) const;

  std::size_t memory_bytes() const {
    return items_.capacity() * sizeof(Item) + item_of_triangle_.capacity() * sizeof(std::uint32_t) +
           nodes_.capacity() * sizeof(Node);
  }

  bool empty() const { return items_.empty(); }

  // One triangle: its corners among the vertices, which all in the neighbourhood share and so stay in the processor's cache.
  struct Item {
    std::array<std::uint32_t, 3> corners;
    std::uint32_t triangle;
  };
  // In the tree's own order, in which neighbours stand near each other.
  const std::vector<Item>& items() const { return items_; }
  const Eigen::Vector3d& corner(const Item& item, std::size_t i) const { return vertices_[item.corners[i]]; }
  // Replaces `best` where the item is nearer, or as near with a smaller index.
  void Test(const Item& item, const Eigen::Vector3d& query, Nearest* best) const;

  struct Within {
    std::uint32_t item;
    double distance;
  };
  // All items within a distance, in no particular order.
  void FindWithin(const Eigen::Vector3d& query, double distance, std::vector<Within>* found) const;

 private:
  // Bounds of four children, by coordinate; a child is a node, or a run of items where its count is not 0.
  struct alignas(16) Node {
    Eigen::Array4f low[3], high[3];
    std::uint32_t first[4];
    std::uint32_t count[4];
    EIGEN_MAKE_ALIGNED_OPERATOR_NEW
  };
  struct Builder;

  const Points& vertices_;
  std::vector<Item> items_;
  std::vector<std::uint32_t> item_of_triangle_;
  std::vector<Node, Eigen::aligned_allocator<Node>> nodes_;
};

}  // namespace sixpoint::metrology
