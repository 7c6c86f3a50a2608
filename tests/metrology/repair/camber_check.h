// A camber line beside its definition.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "metrology/repair/camber_profile.h"
#include "metrology/repair/outline_sides.h"

namespace sixpoint::metrology {

// How much the line's distances from the two sides of the outline differ (published: below 0.022 mm; beyond the circles below 0.012 mm): 0 of the
// true medial axis. The sides part at the profile's tips.
struct CamberCheck {
  double line_mm = 0, leading_extension_mm = 0, trailing_extension_mm = 0;  // greatest magnitudes
};

inline CamberCheck CheckCamber(const CamberProfile& profile, const Outline& outline) {
  const double leading_mm = outline.At(outline.Nearest(profile.leading.tip_mm));
  const double trailing_mm = outline.At(outline.Nearest(profile.trailing.tip_mm));
  const OutlineSides sides(outline, leading_mm, trailing_mm);
  const auto differ = [&](const Eigen::Vector2d& point_mm) { return std::abs(sides.Difference(point_mm)); };
  CamberCheck check;
  for (const CamberStation& station : profile.stations)
    check.line_mm = std::max(check.line_mm, differ(station.centre_mm));
  for (const Eigen::Vector2d& point_mm : profile.leading.points_mm)
    check.leading_extension_mm = std::max(check.leading_extension_mm, differ(point_mm));
  for (const Eigen::Vector2d& point_mm : profile.trailing.points_mm)
    check.trailing_extension_mm = std::max(check.trailing_extension_mm, differ(point_mm));
  return check;
}

}  // namespace sixpoint::metrology
