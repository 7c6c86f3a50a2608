// Where a plane cuts a part's surface.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <vector>

#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// The closed polygons, section frame, the longest first: facets are cut, each piece is divided, and its points are moved within the plane onto
// the curved surface (surface.h), a chordal error then being gone. INVALID_ARGUMENT: the plane misses the surface, or an outline ends at a
// rim of it.
absl::StatusOr<std::vector<std::vector<Eigen::Vector2d>>> CutSurface(const Surface& surface,
                                                                     const Eigen::Isometry3d& part_from_section);

}  // namespace sixpoint::metrology
