// The least-squares circle through points of a plane.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace sixpoint::metrology {

struct FittedCircle {
  Eigen::Vector2d centre_mm;
  double radius_mm = 0;
  double least_mm = 0, greatest_mm = 0;  // residuals: distance from the centre less the radius
  double mean_square_mm2 = 0;            // of the residuals
};

// By the points' distances from the circle. Three points at least that are not in a line; of such in a line the radius is not finite.
FittedCircle FitCircle(const std::vector<Eigen::Vector2d>& points_mm);

}  // namespace sixpoint::metrology
