// Factors between the kernels' units (mm, rad) and those of contract and record (um, deg).
#pragma once

#include <optional>

#include "metrology/frames/angles.h"

namespace sixpoint::runtime {

using metrology::kDegPerRad;
using metrology::kRadPerDeg;
inline constexpr double kUmPerMm = 1e3, kMmPerUm = 1e-3;

inline std::optional<double> In_um(const std::optional<double>& mm) {
  return mm ? std::optional<double>(kUmPerMm * *mm) : std::nullopt;
}

}  // namespace sixpoint::runtime
