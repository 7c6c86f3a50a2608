// Of a point from the straight line between two others, its ends included. Mm.
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace sixpoint::metrology {

inline double DistanceFromSegment(const Eigen::Vector3d& point, const Eigen::Vector3d& from,
                                  const Eigen::Vector3d& to) {
  const Eigen::Vector3d along = to - from;
  const double squared = along.squaredNorm();
  const double share = squared > 0 ? std::clamp((point - from).dot(along) / squared, 0.0, 1.0) : 0;
  return (point - from - share * along).norm();
}

}  // namespace sixpoint::metrology
