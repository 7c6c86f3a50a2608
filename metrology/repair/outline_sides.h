// The two sides of a section's outline, parted at its tips, and the line that is as far from both.
//
// Section frame, mm. Thread-safe.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "metrology/sections/outline.h"

namespace sixpoint::metrology {

// Of a point from one side.
struct SideDistance {
  double distance_mm = 0;
  Eigen::Vector2d contact_mm = Eigen::Vector2d::Zero();
};

class OutlineSides {
 public:
  // Places where the sides part, along the outline. Keeps a reference to it.
  OutlineSides(const Outline& outline, double one_tip_mm, double other_tip_mm)
      : outline_(outline), one_tip_mm_(one_tip_mm), other_tip_mm_(other_tip_mm) {}

  SideDistance FromFirst(const Eigen::Vector2d& point_mm) const { return From(one_tip_mm_, other_tip_mm_, point_mm); }
  SideDistance FromSecond(const Eigen::Vector2d& point_mm) const { return From(other_tip_mm_, one_tip_mm_, point_mm); }
  // Distance from the first less that from the second: 0 of the medial axis.
  double Difference(const Eigen::Vector2d& point_mm) const {
    return FromFirst(point_mm).distance_mm - FromSecond(point_mm).distance_mm;
  }

  // The place nearest to the point, on the line through it along `across`, that is as far from both sides. Absent: not found within the reach,
  // or both contacts are about one place: so near to a tip the line is not told.
  struct Middle {
    Eigen::Vector2d centre_mm;
    double radius_mm = 0;
  };
  std::optional<Middle> MiddleNear(const Eigen::Vector2d& point_mm, const Eigen::Vector2d& across,
                                   double reach_mm) const;

 private:
  SideDistance From(double from_mm, double to_mm, const Eigen::Vector2d& point_mm) const;

  const Outline& outline_;
  double one_tip_mm_, other_tip_mm_;
};

}  // namespace sixpoint::metrology
