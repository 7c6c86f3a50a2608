// Legendre's polynomials: orthogonal over -1 to 1.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace sixpoint::metrology {

// Of the orders 0 to kOrder, each with a mean square of 1 over -1 to 1; beyond it t counts as on its border.
template <int kOrder>
std::array<double, kOrder + 1> Legendre(double t) {
  t = std::clamp(t, -1.0, 1.0);
  std::array<double, kOrder + 1> value{1, t};
  for (int n = 1; n < kOrder; ++n) value[n + 1] = ((2 * n + 1) * t * value[n] - n * value[n - 1]) / (n + 1);
  for (int n = 1; n <= kOrder; ++n) value[n] *= std::sqrt(2 * n + 1.0);
  return value;
}

}  // namespace sixpoint::metrology
