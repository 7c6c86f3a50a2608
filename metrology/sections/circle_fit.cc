#include "metrology/sections/circle_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {

using Eigen::Vector2d;
using Eigen::Vector3d;

FittedCircle FitCircle(const std::vector<Vector2d>& points_mm) {
  // Linear in centre and r^2 - |c|^2 first, then by the distances themselves.
  const Vector2d origin = points_mm[points_mm.size() / 2];
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const Vector2d& point : points_mm) {
    const Vector2d p = point - origin;
    const Vector3d row(2 * p.x(), 2 * p.y(), 1);
    normal += row * row.transpose();
    right += p.squaredNorm() * row;
  }
  const Vector3d solved = normal.ldlt().solve(right);
  FittedCircle circle;
  circle.centre_mm = origin + solved.head<2>();
  circle.radius_mm = std::sqrt(std::max(0.0, solved[2] + solved.head<2>().squaredNorm()));
  for (int turn = 0; turn < 8; ++turn) {
    normal.setZero();
    right.setZero();
    for (const Vector2d& point : points_mm) {
      const Vector2d off = point - circle.centre_mm;
      const Vector3d row(off.x() / off.norm(), off.y() / off.norm(), 1);
      normal += row * row.transpose();
      right += (off.norm() - circle.radius_mm) * row;
    }
    const Vector3d by = normal.ldlt().solve(right);
    circle.centre_mm += by.head<2>();
    circle.radius_mm += by[2];
  }
  circle.least_mm = INFINITY;
  circle.greatest_mm = -INFINITY;
  for (const Vector2d& point : points_mm) {
    const double off = (point - circle.centre_mm).norm() - circle.radius_mm;
    circle.least_mm = std::min(circle.least_mm, off);
    circle.greatest_mm = std::max(circle.greatest_mm, off);
    circle.mean_square_mm2 += off * off / static_cast<double>(points_mm.size());
  }
  return circle;
}

}  // namespace sixpoint::metrology
