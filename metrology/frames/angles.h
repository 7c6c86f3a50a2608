// Angles in rad beside those that people state.
#pragma once

namespace sixpoint::metrology {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kTurn_rad = 2 * kPi;
inline constexpr double kRadPerDeg = kPi / 180, kDegPerRad = 180 / kPi;

}  // namespace sixpoint::metrology
