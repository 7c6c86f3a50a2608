// What of a part's surface its scans have seen, side by side: where a blank was not looked at, nothing is known of its stock.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/registration/fit_options.h"
#include "metrology/registration/patch_sums.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// The surface whose normals look along one axis of the part more than along the others.
struct SeenSide {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // unit, part frame
  double area_mm2 = 0;                                  // within the regions asked for
  double seen_mm2 = 0;                                  // of it, in cells with a point
  // The middle of the rest, off the surface where that is bent; zero where all was seen.
  Eigen::Vector3d unseen_about_mm = Eigen::Vector3d::Zero();

  double seen_part() const { return area_mm2 > 0 ? seen_mm2 / area_mm2 : 0; }
};

// Those of the six that have an area: +x, -x, +y, ... . seen: the cells with points, of this width (PatchKeyOf). The surface is
// looked at in pieces of a sixteenth of a cell. CANCELLED: options.keep_going said so.
absl::StatusOr<std::vector<SeenSide>> SeenSides(const Surface& surface, const std::vector<PatchKey>& seen,
                                                double cell_mm, const FitOptions& options);

}  // namespace sixpoint::metrology
