// Simulated removal of material: dexels along a surface's normals, cut by everything that a mill sweeps (docs/methods/repair.md).
//
// Part frame, mm. Each dexel is cut by itself: the same bits on any number of threads.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "metrology/milling/recontour_path.h"

namespace sixpoint::metrology {

// Material along a line: from within the part up to top_mm above the base, which lies on the surface that is wanted there.
struct Dexel {
  Eigen::Vector3d base_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();  // outward, unit
  double top_mm = 0;
};

// Lowers each dexel to where the first tool meets it, as far down as depth_mm below its base: ball and shank, at every place of every pass, and the
// ball on the straight ways between. Counts of those that were touched come with it.
struct Removal {
  std::vector<double> top_mm;  // of each dexel afterwards: positive: rest; negative: gouge
  std::size_t touched_count = 0;
};
Removal Remove(const std::vector<Dexel>& dexels, const RecontourPath& path, const BallMill& mill, double depth_mm,
               int thread_count);

}  // namespace sixpoint::metrology
