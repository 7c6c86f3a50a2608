// What was measured of a blank, patch by patch.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <vector>

#include "metrology/inspection/surface_patches.h"

namespace sixpoint::metrology {

struct BlankPatch {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();  // on the blank, part frame, after its fit
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // of the blank there, outward, unit
  double standard_uncertainty_mm = 0;                  // of the point along the normal
};

struct GatherOptions {
  int threads = 2;
  double farthest_mm = 1.5;  // of a point from the design
  int least_points = 8;      // a patch with fewer was not seen
};

// Patches of a cloud, at the patches of the design on which its points stand: each at a plane's height through the distances of its points,
// uncertain by their scatter about that. outward: of each point, how the blank's surface looks there, to 45 deg: it tells a thin edge's walls apart.
// INVALID_ARGUMENT: as many directions as points are wanted, and what is finite.
absl::StatusOr<std::vector<BlankPatch>> GatherBlank(const Surface& surface, const SurfacePatches& patches,
                                                    const Points& points_mm, const Points& outward,
                                                    const GatherOptions& options);

}  // namespace sixpoint::metrology
