// Colours of deviations, the same as the page's (web/src/scene/colours.ts): grey within the band, blue inside the surface, red outside, dark
// beyond the scale. A test holds the two equal.
#pragma once

#include <cstdint>

namespace sixpoint::report {

struct Colour {
  std::uint8_t r = 0, g = 0, b = 0;
  friend bool operator==(const Colour& a, const Colour& b) { return a.r == b.r && a.g == b.g && a.b == b.b; }
  friend bool operator!=(const Colour& a, const Colour& b) { return !(a == b); }
};

// Of what was not seen: never a colour of the scale. Hatched, for who does not see colours.
inline constexpr Colour kNotSeen{66, 74, 82}, kNotSeenHatch{120, 128, 136};

// NaN: kNotSeen. 0 <= band_um <= scale_um.
Colour DeviationColour(double deviation_um, double scale_um, double band_um);

// The next of 1, 2, 5, 10, ... that is not less.
double RoundScale(double um);

}  // namespace sixpoint::report
