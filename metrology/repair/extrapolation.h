// A blade's target geometry above the repair line, from its own sections below it (docs/methods/repair.md).
//
// Part and section frames, mm. Thread-safe; the same bits on any number of threads.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "metrology/repair/target_contour.h"

namespace sixpoint::metrology {

enum class ExtrapolationMethod {
  kPolynomial,  // published: camber line and thickness by degree 3 along the chord and 5 in z, ends by degree 2 and 1
  kPolynomialOfDeviation,  // the same regression, of what the individual is off its CAD
  kProcessOfDeviation,     // that deviation in smooth shapes along the section, each a Gaussian process over the height
};

struct Extrapolation {
  std::vector<TargetSection> sections;  // by z
  // Coefficients of determination, of the polynomials alone.
  struct Determination {
    double camber = 0, thickness = 0, leading = 0, trailing = 0;
  };
  std::optional<Determination> determination;
  std::vector<LeftOutSection> left_out;  // of measured: what could not be laid beside its nominal section
};

// measured: sections below the repair line, without those that were left out; nominal: by z, of these heights at least; asked: the nominal sections
// at the target's heights. The published method takes nothing of nominal. INVALID_ARGUMENT, by name: a measured height that no nominal section
// has, and what CheckEnough refuses of the sections that are measured and near their nominal ones ("measured").
absl::StatusOr<Extrapolation> Extrapolate(const std::vector<BladeSection>& measured,
                                          const std::vector<BladeSection>& nominal,
                                          const std::vector<BladeSection>& asked, ExtrapolationMethod method,
                                          int thread_count = 1);

}  // namespace sixpoint::metrology
