// A four-way bounding-volume tree over triangles: finds the nearest of one point exactly, and whether a straight line meets any (double
// precision).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "metrology/nearest/nearest_triangle.h"
#include "metrology/nearest/tree_builder.h"

namespace sixpoint::metrology {

// Read by any number of threads.
class TriangleTree {
 public:
  // Triangles without area are left out. Vertices should be near their origin, since boxes are kept in float; they stay
  // where they are while the tree lives.
  TriangleTree(const Points& vertices, const std::vector<TriangleCorners>& triangles);

  // The nearest triangle within a distance; equal distances go to the smaller index. The hint, a triangle thought near,
  // only saves time.
  NearestTriangle Find(const Eigen::Vector3d& query, double limit_squared, std::uint32_t hint) const;
  // The same of each in turn, from one to the next.
  void FindEach(const Eigen::Vector3d* queries, std::size_t count, double limit_squared, std::uint32_t hint,
                NearestTriangle* nearest) const;

  // All items within a distance of a box, and some a little farther, in the tree's order of its nodes.
  void FindAbout(const Eigen::AlignedBox3d& box, double distance, std::vector<std::uint32_t>* items) const;

  // Whether the straight line between the two meets a triangle, from whichever side; one within the line's own plane is not met.
  bool Meets(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

  bool empty() const { return items().empty(); }
  const std::vector<IndexedTriangle>& items() const { return tree_.items; }
  const Eigen::Vector3d& corner(const IndexedTriangle& item, std::size_t i) const { return vertices_[item.corners[i]]; }
  const Points& vertices() const { return vertices_; }
  std::size_t memory_bytes() const;

 private:
  const Points& vertices_;
  BuiltTree tree_;
  std::vector<std::uint32_t> item_of_triangle_;
};

}  // namespace sixpoint::metrology
