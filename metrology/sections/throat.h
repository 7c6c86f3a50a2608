// The smallest passage between neighbouring blades' sections.
//
// Section frame, mm. Thread-safe.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>

#include "metrology/sections/form_error.h"
#include "metrology/sections/outline_fit.h"

namespace sixpoint::metrology {

struct Throat {
  double width_mm = 0;
  OutlinePlace place, other_place;  // on the outline and on its neighbour
  bool beside_gap = false;          // one of them ends where nothing more was seen: it may be less
};

// section_from_neighbour: where the neighbour's outline stands: by the pitch beside it, turned by an angle about the engine's axis, or,
// of a second section that was measured in the same frame, the identity. INVALID_ARGUMENT: outlines that meet.
absl::StatusOr<Throat> ThroatOf(const Outline& outline, const Outline& neighbour,
                                const Eigen::Isometry2d& section_from_neighbour);

// Of the width: both places' noise and waver, and of the pitch; first order.
double ThroatStandardUncertainty(const Throat& throat, const FittedOutline& outline, const FormError& form,
                                 const FittedOutline& neighbour, const FormError& neighbour_form,
                                 double pitch_standard_uncertainty_mm);

}  // namespace sixpoint::metrology
