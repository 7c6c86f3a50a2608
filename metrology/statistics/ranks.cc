#include "metrology/statistics/ranks.h"

#include <cmath>
#include <utility>

namespace sixpoint::metrology {

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const std::size_t half = values.size() / 2;
  const double upper = AtRank(half, &values);
  if (values.size() % 2 == 1) return upper;
  return (upper + *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(half))) / 2;
}

double UpperMedian(std::vector<double> values) { return values.empty() ? 0 : AtRank(values.size() / 2, &values); }

double RobustSigma(const std::vector<double>& values) {
  const double median = UpperMedian(values);
  std::vector<double> deviations;
  deviations.reserve(values.size());
  for (const double v : values) deviations.push_back(std::abs(v - median));
  return RobustSigmaOfMagnitudes(std::move(deviations));
}

double RobustSigmaOfMagnitudes(std::vector<double> magnitudes) {
  return kSigmaPerMad * UpperMedian(std::move(magnitudes));
}

}  // namespace sixpoint::metrology
