// A part of space in which points count, or do not; part frame.
#pragma once

#include <Eigen/Core>

namespace sixpoint::metrology {

struct Region {
  enum class Shape { kBox, kBall } shape = Shape::kBox;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_mm = Eigen::Vector3d::Zero();  // half the box's edges; a ball's radius in x

  // `margin_mm` makes it larger.
  bool Holds(const Eigen::Vector3d& point_mm, double margin_mm = 0) const {
    const Eigen::Vector3d from = point_mm - centre_mm;
    return shape == Shape::kBall ? from.norm() <= half_mm.x() + margin_mm
                                 : ((from.cwiseAbs() - half_mm).array() <= margin_mm).all();
  }
};

}  // namespace sixpoint::metrology
