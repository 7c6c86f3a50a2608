// Many tests at once: Holm's step-down adjustment, whatever depends on what.
#pragma once

#include <vector>

namespace sixpoint::metrology {

// Of each p the least level at which it would be rejected with all of them tested: at most 1. In the order given.
std::vector<double> HolmAdjusted(const std::vector<double>& p);

}  // namespace sixpoint::metrology
