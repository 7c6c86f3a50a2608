// How many numbers this processor computes with at a time. Loops over points side by side are compiled for each width; what comes of them has
// the same bits in every one.
#pragma once

#include <vector>

namespace sixpoint::metrology {

// Floats: SSE2 or what the processor has at least; AVX2 with FMA; AVX-512.
enum class LaneWidth { kFour, kEight, kSixteen };

// Those that this processor has, the widest last.
std::vector<LaneWidth> LaneWidths();

// What is used from now on, all of this process: the widest, unless a test or benchmark, or $SIXPOINT_LANES (4, 8, 16), asks for
// another that this processor has. Only the time depends on it.
LaneWidth UsedLaneWidth();
void UseLaneWidth(LaneWidth width);

}  // namespace sixpoint::metrology
