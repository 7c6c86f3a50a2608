// Of a profile tolerance which deviation tells it.
#pragma once

namespace sixpoint::inspection {

struct ProfileLimits {
  double lower_mm = 0, upper_mm = 0;
};

// Of both ends the one that is nearer to its limit, or farther beyond it.
inline bool UpperEndIsWorse(const ProfileLimits& limits, double lowest_mm, double highest_mm) {
  return highest_mm - limits.upper_mm > limits.lower_mm - lowest_mm;
}

}  // namespace sixpoint::inspection
