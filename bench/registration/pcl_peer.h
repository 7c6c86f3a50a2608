// What one would do with PCL: iterative closest points, point to plane, onto points sampled from the mesh.
#pragma once

#include "bench/registration/cases.h"

namespace sixpoint::bench {

struct PeerFit {
  Eigen::Isometry3d scan_from_part = Eigen::Isometry3d::Identity();
  double seconds = 0;
  double processor_s = 0;
  int iteration_count = 0;
};

// Onto half a million points spread by area, each with its triangle's normal: the mesh's own vertices stand only along the
// rim of the tip, which takes PCL 0.25 mm off. Their search tree is built before the clock starts. Takes every stride-th
// point of the scan.
PeerFit PclPointToPlane(const Blade& blade, const metrology::Points& scan_mm, std::size_t stride);

}  // namespace sixpoint::bench
