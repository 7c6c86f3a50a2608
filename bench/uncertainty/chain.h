// One blade through a plant whose errors are drawn: the scanner is calibrated on a touched plate, the arm swings, the blade is scanned,
// registered and corrected. Every step is solved as a plant solves it, none is linearised; what the scanner's field really is has nothing
// of the polynomials that the estimator knows.
#pragma once

#include <cstdint>
#include <vector>

#include "bench/uncertainty/world.h"

namespace sixpoint::bench {

struct HoleOutcome {
  double error_um = 0, expanded_uncertainty_um = 0;
};

// Of one draw, its holes' starts. Ends the program where a step fails.
std::vector<HoleOutcome> DrawHoles(const WorldErrors& errors, std::uint64_t seed);

}  // namespace sixpoint::bench
