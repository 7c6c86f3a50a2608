// An interim check of a scanner whose errors are drawn, knocked or not.
#pragma once

#include <cstdint>

#include "bench/uncertainty/world.h"

namespace sixpoint::bench {

enum class Knock { kNone, kShift, kTurn };

// How often the arm was swung, with a scan each time: for the calibration, and since.
struct Swings {
  int calibrated = 1;
  int since = 0;  // 0: not at all, one scan all the same
};

// One draw: the scanner is calibrated, knocked (by so much along any direction, or turned about the middle of its field so that the field's
// border moves by so much), and scans the plate again, up to a millimetre elsewhere in the field. Whether the check accepts, by a limit of
// knock_mm.
bool Accepts(const WorldErrors& errors, Knock knock, double knock_mm, Swings swings, std::uint64_t seed);

}  // namespace sixpoint::bench
