// Where the CAD's faces do not meet: how far off they are near a point of the surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

// Read by any number of threads.
class GapZone {
 public:
  // As far from an edge with a gap nobody knows which of its faces the part follows.
  static constexpr double kReachMm = 1;

  GapZone() = default;
  explicit GapZone(const TriangleMesh& mesh);

  bool empty() const { return cells_.empty(); }
  // The greatest gap within reach of the point, part frame; 0: none.
  double At(const Eigen::Vector3d& point_mm) const;
  std::size_t memory_bytes() const { return byte_count_; }

 private:
  struct Gap {
    Eigen::Vector3d at_mm;
    double gap_mm;
  };
  std::unordered_map<std::uint64_t, std::vector<Gap>> cells_;  // as wide as the reach
  std::size_t byte_count_ = 0;
};

}  // namespace sixpoint::metrology
