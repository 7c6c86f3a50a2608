// What an individual section is off the nominal one of its height: camber line, thickness and both ends (docs/methods/repair.md).
//
// Section frame, mm. Thread-safe.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>

#include "metrology/repair/blade_sections.h"

namespace sixpoint::metrology {

// A turn about a pivot and a shift, within the section's plane.
struct PlaneMotion {
  double turn_rad = 0;
  Eigen::Vector2d shift_mm = Eigen::Vector2d::Zero();
  Eigen::Isometry2d About(const Eigen::Vector2d& pivot_mm) const;
};

struct SectionDeviation {
  PlaneMotion
      moved;  // of the whole section, from where it is nominally: least squares along the outline (sections/profile.h)
  // What is left when that is undone.
  Eigen::VectorXd
      camber_mm;  // at each nominal station: of the camber line to the left of it, seen from leading to trailing
  Eigen::VectorXd radius_mm;               // there: of half the thickness
  double leading_mm = 0, trailing_mm = 0;  // of the tips, outward along the nominal ends' directions
  Outline in_place;                        // the individual outline, with the motion undone
};

// pivot_mm: of the motion. INVALID_ARGUMENT, field "outline": the individual camber line does not pass a nominal station's normal within 3 mm.
absl::StatusOr<SectionDeviation> DeviationOf(const BladeSection& nominal, const BladeSection& measured,
                                             const Eigen::Vector2d& pivot_mm);

}  // namespace sixpoint::metrology
