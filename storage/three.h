// Points and directions as an array column has them.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

namespace sixpoint::storage {

// The database holds them to three; where there are fewer, the rest is 0.
inline std::array<double, 3> ThreeOf(const std::vector<double>& values) {
  std::array<double, 3> three{};
  std::copy_n(values.begin(), std::min<std::size_t>(3, values.size()), three.begin());
  return three;
}

inline std::vector<double> ListOf(const std::array<double, 3>& three) { return {three.begin(), three.end()}; }

}  // namespace sixpoint::storage
