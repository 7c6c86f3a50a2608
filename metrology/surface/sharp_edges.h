// The sharp edges and open rims of a surface: how far a point lies from the nearest of them, whatever the triangles that meet
// there look like. Next to a trailing edge they are micrometres wide, and on a cap they may run along its rim.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

class SharpEdges {
 public:
  struct Edge {
    Eigen::Vector3d from_mm, along_mm;
  };

  SharpEdges() = default;
  explicit SharpEdges(std::vector<Edge> edges);

  bool empty() const { return edges_.empty(); }
  // From the nearest edge; infinite where none is within reach.
  double Distance(const Eigen::Vector3d& point_mm, double reach_mm) const;
  std::size_t memory_bytes() const {
    return edges_.capacity() * sizeof(Edge) + nodes_.capacity() * sizeof(Eigen::AlignedBox3d);
  }

 private:
  using Range = std::pair<std::size_t, std::size_t>;
  void Bound(std::size_t node, Range range);
  void Search(std::size_t node, Range range, const Eigen::Vector3d& point_mm, double* squared) const;

  std::vector<Edge> edges_;                 // in halves, down to leaves
  std::vector<Eigen::AlignedBox3d> nodes_;  // a heap: the halves of node n are 2n + 1 and 2n + 2
};

}  // namespace sixpoint::metrology
