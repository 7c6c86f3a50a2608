// Values by their rank, which a few wild ones do not move.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sixpoint::metrology {

// Standard deviation of normal values for each unit of their median absolute deviation (MAD).
constexpr double kSigmaPerMad = 1.4826;

// The value with `rank` smaller or equal ones before it, rank < size(). The list is reordered.
template <typename Value>
Value AtRank(std::size_t rank, std::vector<Value>* values) {
  const auto at = values->begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values->begin(), at, values->end());
  return *at;
}

// Of an even number of values the mean of the middle two; 0 for none.
double Median(std::vector<double> values);
// Of an even number of values the upper of the middle two, in half the time: for long lists. 0 for none.
double UpperMedian(std::vector<double> values);

// Standard deviation of normal values, from the median of their deviations about the median; 0 for none.
double RobustSigma(const std::vector<double>& values);
// The same of values about 0, from their magnitudes.
double RobustSigmaOfMagnitudes(std::vector<double> magnitudes);

}  // namespace sixpoint::metrology
