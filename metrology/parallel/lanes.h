// Numbers side by side, one of each lane, and what loops over them begin and end with. Number: a double, or a vector of them
// (vectors.h); every width does the same in the same order, so that each lane comes to the bits of a double.
#pragma once

#include <cstddef>

#define SIXPOINT_INLINE inline __attribute__((always_inline))

namespace sixpoint::metrology {

struct alignas(64) LaneRow {
  static constexpr std::size_t kLanes = 8;  // of the widest vectors
  double at[kLanes];
};

template <typename Number>
SIXPOINT_INLINE void Load(const LaneRow& row, std::size_t lane, Number& numbers) {
  __builtin_memcpy(&numbers, &row.at[lane], sizeof numbers);
}
template <typename Number>
SIXPOINT_INLINE void Store(const Number& numbers, std::size_t lane, LaneRow& row) {
  __builtin_memcpy(&row.at[lane], &numbers, sizeof numbers);
}
template <typename Number, std::size_t count>
SIXPOINT_INLINE void Load(const LaneRow (&rows)[count], std::size_t lane, Number (&numbers)[count]) {
  for (std::size_t k = 0; k < count; ++k) Load(rows[k], lane, numbers[k]);
}
template <typename Number, std::size_t count>
SIXPOINT_INLINE void Store(const Number (&numbers)[count], std::size_t lane, LaneRow (&rows)[count]) {
  for (std::size_t k = 0; k < count; ++k) Store(numbers[k], lane, rows[k]);
}

// Of two directions; in the order of Eigen's.
template <typename Number>
SIXPOINT_INLINE Number Product(const Number (&one)[3], const Number (&other)[3]) {
  return (one[0] * other[0] + one[1] * other[1]) + one[2] * other[2];
}

}  // namespace sixpoint::metrology
