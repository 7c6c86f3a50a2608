// One quantity over n repeats.
#pragma once

#include <vector>

namespace sixpoint::metrology {

struct Spread {
  int count = 0;
  double minimum = 0, maximum = 0, mean = 0;
  double mean_standard_uncertainty = 0;                // s / sqrt(n)
  double standard_deviation = 0;                       // s, of n - 1 degrees of freedom
  double standard_deviation_standard_uncertainty = 0;  // s / sqrt(2 (n - 1)): normal values
};

// Of two or more finite values.
Spread SpreadOf(const std::vector<double>& values);

}  // namespace sixpoint::metrology
