// Paths of a fan, and a blade that stands some centimetres from skewed axes.
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "metrology/correction/tool_path.h"
#include "metrology/frames/angles.h"
#include "tests/metrology/correction/exact_pose.h"

namespace sixpoint::metrology {

inline const RotaryLimits kWideLimits{-100 * kRadPerDeg, 100 * kRadPerDeg, -360 * kRadPerDeg, 360 * kRadPerDeg};
// From pose to pose: a degree, and four times as much as the tool's axis turns; linear axes follow on a lever of 300 mm.
inline const PathContinuity kSomeSteps{{1 * kRadPerDeg, 0, 4}, {1, 2, 1200}};

// On the plane Z = 0 of the part along X, from the middle out; the axis leans from upright to 20 degrees along X.
inline NominalToolPath FanOnAPlane(int count) {
  NominalToolPath path;
  path.name = "F1";
  path.position_tolerance_mm = 0.05;
  path.inclination_tolerance_rad = 0.5 * kRadPerDeg;
  for (int k = 0; k < count; ++k) {
    const double share = count > 1 ? k / (count - 1.0) : 0;
    const double lean_rad = 20 * kRadPerDeg * share;
    path.poses.push_back({{2 * share, 0, 0}, {std::sin(lean_rad), 0, std::cos(lean_rad)}});
  }
  return path;
}

// Skewed axes that do not meet.
inline RotaryAxes SomeAxes() {
  RotaryAxes axes;
  axes.a = {Eigen::Vector3d(1e-4, 1, -2e-4).normalized(), {26.63, 54.88, -193.1}};
  axes.b = {Eigen::Vector3d(1, -1e-4, 3e-4).normalized(), {26.63, 54.87, -193.11}};
  return axes;
}

// Of zero from part: nominal, and as the blade stands.
struct SomePlace {
  Eigen::Isometry3d nominal = Eigen::Isometry3d::Identity(), real = nominal;
  explicit SomePlace(std::mt19937_64& random) {
    std::uniform_real_distribution<double> unit(-1, 1);
    const auto vector = [&](double scale) -> Eigen::Vector3d {
      return scale * Eigen::Vector3d(unit(random), unit(random), unit(random));
    };
    nominal.linear() = RotationFromVector(vector(0.6));
    nominal.translation() = SomeAxes().a.point_mm + Eigen::Vector3d(40, 5, 10);
    real.linear() = RotationFromVector(vector(0.01)) * nominal.linear();
    real.translation() = nominal.translation() + vector(0.3);
  }
};

}  // namespace sixpoint::metrology
