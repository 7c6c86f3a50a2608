// Clouds as other people's senders encode them with Draco's own defaults, not as metrology/cloud does.
#pragma once

#include <string>

#include "metrology/frames/pose.h"

namespace sixpoint::testing {

// One POSITION of float32, sequential. `bits` 0: not quantised; `speed`: Draco's 0 (smallest) to 10 (fastest).
std::string StockDraco(const metrology::Points& points_mm, int bits, int speed);

}  // namespace sixpoint::testing
