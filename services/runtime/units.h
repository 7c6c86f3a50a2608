// Factors between the kernels' units (mm, rad) and those of contract and record (um, deg).
#pragma once

#include <optional>

namespace sixpoint::runtime {

inline constexpr double kRadPerDeg = 3.14159265358979323846 / 180, kDegPerRad = 180 / 3.14159265358979323846;
inline constexpr double kUmPerMm = 1e3, kMmPerUm = 1e-3;

inline std::optional<double> In_um(const std::optional<double>& mm) {
  return mm ? std::optional<double>(kUmPerMm * *mm) : std::nullopt;
}

}  // namespace sixpoint::runtime
