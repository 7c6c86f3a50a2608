#include "metrology/statistics/spread.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {

Spread SpreadOf(const std::vector<double>& values) {
  Spread spread;
  spread.count = static_cast<int>(values.size());
  if (values.empty()) return spread;
  const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
  spread.minimum = *least;
  spread.maximum = *greatest;
  const double n = spread.count;
  // About the first value: large offsets cost no digits.
  double sum = 0, squares = 0;
  for (const double v : values) sum += v - values.front();
  spread.mean = values.front() + sum / n;
  if (spread.count < 2) return spread;
  for (const double v : values) squares += (v - spread.mean) * (v - spread.mean);
  spread.standard_deviation = std::sqrt(squares / (n - 1));
  spread.mean_standard_uncertainty = spread.standard_deviation / std::sqrt(n);
  spread.standard_deviation_standard_uncertainty = spread.standard_deviation / std::sqrt(2 * (n - 1));
  return spread;
}

}  // namespace sixpoint::metrology
