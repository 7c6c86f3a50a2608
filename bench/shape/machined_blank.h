// A blank machined to its shape by a mill that gives way, scanned, and machined once more by what the first pass left.
//
// The mill is a ball on the adapted path over both edges. Its place is off its command by what it is off anyway and by a share of what it
// removes, more towards the blade's tip, which gives way too: no two numbers for a region, as the kernel that learns from it takes them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "bench/shape/blade_blanks.h"

namespace sixpoint::bench {

struct MachinedRange {
  // Of the machined surface above the shape, as scanned; the greatest above what the template leaves of the design.
  double least_um = 1e9, greatest_um = -1e9;
  void Add(const MachinedRange& other) {
    least_um = std::min(least_um, other.least_um);
    greatest_um = std::max(greatest_um, other.greatest_um);
  }
};

struct MachinedBlank {
  MachinedRange stiff;          // one pass of a mill that does not give way
  MachinedRange first, second;  // of one that does; the second is commanded by what the first left
  double most_removed_mm = 0, by_template_um = 0;
};

// judged: the places that are scanned; made: the blank's shape.
absl::StatusOr<MachinedBlank> MachineBlank(const metrology::Surface& vane, const metrology::DesignPlaces& design,
                                           const metrology::DesignPlaces& judged, const BladeCase& blade,
                                           const metrology::Reconstruction& made, std::uint64_t seed, int threads);

}  // namespace sixpoint::bench
