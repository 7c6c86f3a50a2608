// Lengths at 20 C (ISO 1) of what was measured warmer or colder (docs/methods/uncertainty.md, error sources).
#pragma once

#include <optional>

namespace sixpoint::metrology {

inline constexpr double kReferenceTemperatureC = 20;

struct ExpansionCoefficient {
  double per_k = 0;
  double standard_uncertainty_per_k = 0;
};
struct Temperature {
  double c = kReferenceTemperatureC;
  double standard_uncertainty_k = 0;
};
// Somewhere within the range about 20 C, anywhere as likely.
Temperature Within(double half_range_k);

// How many times as long as at 20 C it is, measured by scales that expand too; each cause of its uncertainty apart.
struct Stretch {
  double ratio = 1;
  double by_coefficients = 0;  // standard uncertainty, k = 1
  double by_temperatures = 0;
};
Stretch StretchOf(const ExpansionCoefficient& part, const Temperature& part_at,
                  const std::optional<ExpansionCoefficient>& scales, const std::optional<Temperature>& scales_at);

}  // namespace sixpoint::metrology
