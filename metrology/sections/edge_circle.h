// The least-squares circle of a section's end.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "metrology/sections/camber.h"
#include "metrology/sections/outline.h"

namespace sixpoint::metrology {

constexpr double kEdgeNormalCosine = 0.6427876;  // 50 deg: as far from the end's direction its circle's normals go

struct EdgeCircle {
  Eigen::Vector2d centre_mm;
  double radius_mm = 0, form_mm = 0;  // form: greatest less least distance from the circle
};

// Of a round end, from its tip both ways to the last normal within 50 deg of the end's direction, equally spaced. Absent: a gap or a corner
// comes first.
std::optional<EdgeCircle> EdgeCircleOf(const Outline& outline, const SectionEnd& end);

}  // namespace sixpoint::metrology
