// What sections say together: twist and bow over the span.
//
// Part frame; mm and radians. Thread-safe.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <vector>

#include "metrology/sections/section_uncertainty.h"

namespace sixpoint::metrology {

struct SpanValue {
  std::optional<double> value;  // rad or mm
  NotMeasured reason = NotMeasured::kMeasured;
  double standard = 0, expanded = 0;
};

// Of each section, from the reference section: how much more its stagger is than there, less the nominal sections' same. What all sections
// have from one pose takes itself off. expanded: k = 2.
// INVALID_ARGUMENT: no sections, a reference that is none, nominal sections of another number (none: 0 is taken off).
absl::StatusOr<std::vector<SpanValue>> TwistOf(const std::vector<MeasuredSection>& sections,
                                               const std::vector<SectionValues>& nominal, std::size_t reference,
                                               SectionParameter stagger = SectionParameter::kStaggerNoseTail);

// Of each section: its greatest circle's centre, across the straight line through those of the first and last section: along the sections' x
// and y. With nominal sections less their own same. The planes are parallel. INVALID_ARGUMENT: fewer than three sections, planes that are
// not parallel, the first and last at one height.
struct Bow {
  SpanValue x, y;
};
absl::StatusOr<std::vector<Bow>> BowOf(const std::vector<MeasuredSection>& sections,
                                       const std::vector<SectionValues>& nominal);

}  // namespace sixpoint::metrology
