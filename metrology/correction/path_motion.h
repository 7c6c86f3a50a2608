// Where the tool is on the part while all five axes go straight, in their commands, from one pose of a path to the next.
//
// Frames: zero (the part as it stands at A = B = 0, as warm as it is), machine. Units: mm and radians. Pure and thread-safe.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "metrology/correction/tool_path.h"

namespace sixpoint::metrology {

class PathMotion {
 public:
  // axes, positioning: as the poses were corrected with.
  PathMotion(const CorrectedToolPose& from, const CorrectedToolPose& to, const RotaryAxes& axes,
             const RotaryPositioning& positioning);

  struct Place {
    Eigen::Vector3d tip_in_zero_mm, axis_in_zero;
  };
  // share: of the way, 0 to 1.
  Place At(double share) const;

  // From 0 to 1, where a table bends: the angles that are reached are linear in the share between two of them.
  const std::vector<double>& bends() const { return bends_; }

  // Of a point of the tool's axis, its height above the tip, at every share between two of which no bend lies between; per unit of share.
  struct Rates {
    double speed_mm = 0;  // its greatest speed
    double bend_mm = 0;   // its greatest second derivative
    double turn_rad = 0;  // greatest speed of the axis's direction, whose second derivative is at most turn_rad^2
  };
  Rates RatesBetween(double from_share, double to_share, double height_mm) const;

 private:
  Eigen::Vector3d TipInMachine(double share) const { return from_mm_ + share * (to_mm_ - from_mm_); }
  RotaryAngles Reached(double share) const;

  RotaryAxes axes_;
  RotaryPositioning positioning_;
  Eigen::Vector3d from_mm_, to_mm_;    // machine
  RotaryAngles from_, to_;             // commanded
  Eigen::Vector3d on_a_mm_, on_b_mm_;  // points of both axes, each nearest to the other
  std::vector<double> bends_;
};

}  // namespace sixpoint::metrology
