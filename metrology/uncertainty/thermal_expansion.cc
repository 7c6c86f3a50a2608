#include "metrology/uncertainty/thermal_expansion.h"

#include <cmath>

namespace sixpoint::metrology {

Temperature Within(double half_range_k) { return {kReferenceTemperatureC, half_range_k / std::sqrt(3.0)}; }

Stretch StretchOf(const ExpansionCoefficient& part, const Temperature& part_at,
                  const std::optional<ExpansionCoefficient>& scales, const std::optional<Temperature>& scales_at) {
  Stretch stretch;
  const auto add = [&](const ExpansionCoefficient& of, const Temperature& at, double sense) {
    const double warmer_k = at.c - kReferenceTemperatureC;
    stretch.ratio += sense * of.per_k * warmer_k;
    stretch.by_coefficients = std::hypot(stretch.by_coefficients, of.standard_uncertainty_per_k * warmer_k);
    // Of a product of two that are uncertain (GUM 5.1.2, note): what both do together counts where the temperature is near 20 C.
    stretch.by_temperatures = std::hypot(
        stretch.by_temperatures, std::hypot(of.per_k, of.standard_uncertainty_per_k) * at.standard_uncertainty_k);
  };
  add(part, part_at, 1);
  if (scales && scales_at) add(*scales, *scales_at, -1);
  return stretch;
}

}  // namespace sixpoint::metrology
