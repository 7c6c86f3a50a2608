// How a camber line goes on beyond its last circle to where it leaves the outline. Section frame, mm. Used by camber_profile.cc alone.
#pragma once

#include <Eigen/Core>

#include "metrology/repair/camber_profile.h"

namespace sixpoint::metrology {

// From a place on along a parabola.
struct Way {
  Eigen::Vector2d from_mm, along;
  double bend = 0;
  Eigen::Vector2d At(double x) const { return from_mm + x * along + bend * x * x * LeftOf(along); }
};

// A sharp end's line ends where the outline does: then it goes straight to the corner.
CamberExtension ExtensionAlong(Way way, const Outline& outline, double longest_mm, const SectionEnd& end);

// Each of its places moved to the middle as long as that is told; from there straight on. The tip parts the sides, and so is found again.
// inside_mm: a place of the line half a radius before its last circle.
CamberExtension BisectedExtension(CamberExtension extension, const Outline& outline, double far_tip_mm,
                                  const Eigen::Vector2d& inside_mm, double radius_mm);

}  // namespace sixpoint::metrology
