// Whether the same hole is off on every blade.
#pragma once

#include <vector>

#include "metrology/efficacy/blade_estimates.h"

namespace sixpoint::metrology {

// By name. angles: what the rotary axes are off by, taken off first; 0 where they were not told apart.
std::vector<HoleBias> HoleBiases(const std::vector<SeenBlade>& blades, const Eigen::Vector2d& angles,
                                 double confidence);

}  // namespace sixpoint::metrology
