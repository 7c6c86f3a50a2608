// A slope that a few wild values do not move: the median of all pairs' slopes, with Kendall's test (Theil 1950, Sen 1968;
// docs/methods/efficacy.md).
#pragma once

#include <optional>
#include <vector>

namespace sixpoint::metrology {

struct TheilSenSlope {
  double slope = 0;
  // Where so few pairs leave a bound open, none.
  std::optional<double> lower, upper;
  double p = 1;  // of no trend, two-sided
};

// Times need not be in order; pairs at one time say nothing of a slope. Up to 60 different times and values the distribution is exact,
// else normal with Kendall's correction for ties. None: fewer than three values, or all at one time.
std::optional<TheilSenSlope> FitTheilSen(const std::vector<double>& times, const std::vector<double>& values,
                                         double confidence);

}  // namespace sixpoint::metrology
