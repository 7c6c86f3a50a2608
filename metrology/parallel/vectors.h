// Vectors by name, of each width: left to itself the compiler may not turn comparisons into masks, and makes scalar code of such
// a loop for every processor without AVX-512. Included by the .cc of such loops alone.
#pragma once

#include <cstddef>
#include <cstdint>

#include "metrology/parallel/lane_width.h"
#include "metrology/parallel/lanes.h"

// Of the functions that a loop is compiled as, where the width is not the least. Other processors' are never asked for.
#ifdef __x86_64__
#define SIXPOINT_EIGHT __attribute__((target("avx2,fma")))
#define SIXPOINT_SIXTEEN __attribute__((target("avx512f,avx512vl,avx512dq")))
#else
#define SIXPOINT_EIGHT
#define SIXPOINT_SIXTEEN
#endif

namespace sixpoint::metrology {

struct Four {
  static constexpr std::size_t kFloats = 4, kDoubles = 2;
  typedef float Floats __attribute__((vector_size(16), may_alias));
  typedef double Doubles __attribute__((vector_size(16)));
  typedef std::uint32_t Indices __attribute__((vector_size(16), may_alias));
};
struct Eight {
  static constexpr std::size_t kFloats = 8, kDoubles = 4;
  typedef float Floats __attribute__((vector_size(32), may_alias));
  typedef double Doubles __attribute__((vector_size(32)));
  typedef std::uint32_t Indices __attribute__((vector_size(32), may_alias));
};
struct Sixteen {
  static constexpr std::size_t kFloats = 16, kDoubles = 8;
  typedef float Floats __attribute__((vector_size(64), may_alias));
  typedef double Doubles __attribute__((vector_size(64)));
  typedef std::uint32_t Indices __attribute__((vector_size(64), may_alias));
};

// That of a loop's functions which is compiled for the width.
template <typename Function>
Function OfWidth(LaneWidth width, Function four, Function eight, Function sixteen) {
  return width == LaneWidth::kSixteen ? sixteen : width == LaneWidth::kEight ? eight : four;
}

}  // namespace sixpoint::metrology
