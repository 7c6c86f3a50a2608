// Covariances of made-up measurements.
#pragma once

#include <vector>

namespace sixpoint::seed {

// size x size with `value` on the diagonal, from place `from` on `value_from`.
inline std::vector<double> Diagonal(std::size_t size, double value, std::size_t from, double value_from) {
  std::vector<double> matrix(size * size, 0);
  for (std::size_t i = 0; i < size; ++i) matrix[i * size + i] = i < from ? value : value_from;
  return matrix;
}

}  // namespace sixpoint::seed
