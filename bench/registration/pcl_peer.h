// What one would do with PCL: iterative closest points, point to plane, onto the mesh's vertices and normals.
#pragma once

#include "bench/registration/cases.h"

namespace sixpoint::bench {

struct PeerFit {
  Eigen::Isometry3d scan_from_part = Eigen::Isometry3d::Identity();
  double seconds = 0;
  double processor_s = 0;
  int iteration_count = 0;
};

// The search tree over the vertices is built before the clock starts. Every stride-th point of the scan.
PeerFit PclPointToPlane(const Blade& blade, const metrology::Points& scan_mm, std::size_t stride);

}  // namespace sixpoint::bench
