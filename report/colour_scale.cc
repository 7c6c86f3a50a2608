#include "report/colour_scale.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::report {
namespace {

constexpr Colour kGrey{214, 218, 214}, kBelow{10, 24, 82}, kAbove{84, 4, 28};
constexpr Colour kBlue[] = {{172, 205, 235}, {84, 146, 212}, {22, 74, 158}};
constexpr Colour kRed[] = {{250, 196, 170}, {231, 105, 76}, {172, 24, 36}};

Colour Along(const Colour (&colours)[3], double t) {
  const double at = std::clamp(2 * t, 0.0, 2.0);
  const int i = std::min(1, static_cast<int>(at));
  const double f = at - i;
  const auto mixed = [f](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::floor(a * (1 - f) + b * f + 0.5));
  };
  return {mixed(colours[i].r, colours[i + 1].r), mixed(colours[i].g, colours[i + 1].g),
          mixed(colours[i].b, colours[i + 1].b)};
}

}  // namespace

Colour DeviationColour(double deviation_um, double scale_um, double band_um) {
  if (std::isnan(deviation_um)) return kNotSeen;
  const double size = std::abs(deviation_um);
  if (size > scale_um) return deviation_um > 0 ? kAbove : kBelow;
  if (size <= band_um) return kGrey;
  return Along(deviation_um > 0 ? kRed : kBlue, (size - band_um) / std::max(1e-9, scale_um - band_um));
}

double RoundScale(double um) {
  const double power = std::pow(10, std::floor(std::log10(std::max(0.5, um))));
  for (const double step : {1.0, 2.0, 5.0, 10.0})
    if (step * power >= um * 0.999) return step * power;
  return 10 * power;
}

}  // namespace sixpoint::report
