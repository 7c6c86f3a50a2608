// The outline of a part in a plane: from measured points, or from its CAD surface. Both come out as the same curve, so that nominal and
// measured are evaluated alike.
//
// Part frame in, section frame out; mm. Thread-safe; the same bits on any number of threads, and in whatever order points come.
#pragma once

#include <absl/status/statusor.h>

#include "metrology/frames/pose.h"
#include "metrology/sections/outline_fit.h"
#include "metrology/sections/section_plane.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

struct OutlineOptions {
  double half_width_mm = 0.1;        // points no farther from the plane are taken
  double noise_um = 2;               // of a point, one sigma; 0: what the residuals show
  const Surface* surface = nullptr;  // along which points slide into the plane; none: the lean is fitted
  double surface_reach_mm = 1;       // points farther from it are not of the part
  const Outline* nominal = nullptr;  // says which of several outlines is meant
  double nominal_reach_mm = 1;
  double gap_mm = 0;             // without a point over so much, nothing was seen; 0: from how far apart the points are
  bool without_corners = false;  // both ends are known to be round: few points about a small radius are no corner
  int thread_count = 1;
};

// How the points were used.
struct OutlineEvidence {
  std::int64_t in_slab_count = 0, used_count = 0, outlier_count = 0, stray_count = 0;
  std::int64_t not_finite_count = 0, far_count = 0, platform_count = 0;
  // How much a point at the slab's rim is off by the second order of the lean, where no surface is given: an estimate, um.
  double lean_bound_um = 0;
};

struct SectionOutline {
  FittedOutline fitted;
  Eigen::Isometry3d part_from_section = NotYet<Eigen::Isometry3d>();
  OutlineEvidence evidence;
};

// INVALID_ARGUMENT by name: values out of bounds, a plane that misses the points, several outlines.
absl::StatusOr<SectionOutline> MeasuredOutline(const Points& points_mm, const SectionPlane& plane,
                                               const OutlineOptions& options);
// near_mm (part frame): of several outlines the one that comes nearest to it; without it several are refused. without_corners: as in OutlineOptions.
absl::StatusOr<SectionOutline> SurfaceOutline(const Surface& surface, const SectionPlane& plane,
                                              const Eigen::Vector3d* near_mm, bool without_corners = false);

}  // namespace sixpoint::metrology
