#include "metrology/surface/curvature.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// h = o + s0 u + s1 v + (a u^2 + 2 b u v + c v^2) / 2 + (d u^3 + 3 e u^2 v + 3 f u v^2 + g v^3) / 6
constexpr Eigen::Index kUnknowns = 10, kWithoutCubes = 6;
constexpr double kNearest = 1e-2;     // of the farthest point's squared distance: nearer ones do not weigh more
constexpr double kLeastCosine = 0.1;  // of a normal with the point's own: beyond it lies another side of the body

}  // namespace

SurfaceCurvature CurvatureFrom(const std::vector<OrientedPoint>& nearby, const OrientedPoint& at) {
  const Vector3d& n = at.normal;
  Eigen::Index least_axis;
  n.cwiseAbs().minCoeff(&least_axis);
  const Vector3d u_axis = n.cross(Vector3d::Unit(least_axis)).normalized(), v_axis = n.cross(u_axis);
  double size_mm = 0;
  for (const OrientedPoint& p : nearby) size_mm = std::max(size_mm, (p.point_mm - at.point_mm).norm());
  if (!(size_mm > 0)) return {};
  Eigen::MatrixXd matrix(3 * nearby.size(), kUnknowns);
  Eigen::VectorXd right(3 * nearby.size());
  Eigen::Index rows = 0;
  for (const OrientedPoint& p : nearby) {
    const double cosine = p.normal.dot(n);
    if (!(cosine > kLeastCosine)) continue;
    const Vector3d from = (p.point_mm - at.point_mm) / size_mm;
    const double u = from.dot(u_axis), v = from.dot(v_axis);
    matrix.row(rows) << 1, u, v, u * u / 2, u * v, v * v / 2, u * u * u / 6, u * u * v / 2, u * v * v / 2,
        v * v * v / 6;
    right[rows++] = from.dot(n);
    matrix.row(rows) << 0, 1, 0, u, v, 0, u * u / 2, u * v, v * v / 2, 0;
    right[rows++] = -p.normal.dot(u_axis) / cosine;
    matrix.row(rows) << 0, 0, 1, 0, u, v, 0, u * u / 2, u * v, v * v / 2;
    right[rows++] = -p.normal.dot(v_axis) / cosine;
    const double near = 1 / (from.squaredNorm() + kNearest);  // the surface may bend otherwise farther off
    matrix.middleRows(rows - 3, 3) *= near;
    right.segment(rows - 3, 3) *= near;
  }
  // Points on a line leave what lies beside it open.
  if (rows < kWithoutCubes) return {};
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> quadric(matrix.topRows(rows).leftCols(kWithoutCubes));
  if (quadric.rank() < kWithoutCubes) return {};
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> cubic(matrix.topRows(rows));
  const Eigen::VectorXd h = cubic.rank() == kUnknowns ? Eigen::VectorXd(cubic.solve(right.head(rows)))
                                                      : Eigen::VectorXd(quadric.solve(right.head(rows)));
  // Second fundamental form over the first; slopes are small, for the tangent plane is the point's own.
  Eigen::Matrix2d first, second;
  first << 1 + h[1] * h[1], h[1] * h[2], h[1] * h[2], 1 + h[2] * h[2];
  second << h[3], h[4], h[4], h[5];
  second *= -1 / (size_mm * std::sqrt(1 + h[1] * h[1] + h[2] * h[2]));
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d> principal(second, first);
  SurfaceCurvature found;
  found.least_per_mm = principal.eigenvalues()[0];
  found.greatest_per_mm = principal.eigenvalues()[1];
  const Eigen::Vector2d along = principal.eigenvectors().col(1);
  found.greatest_direction = (along[0] * (u_axis + h[1] * n) + along[1] * (v_axis + h[2] * n)).normalized();
  return found;
}

}  // namespace sixpoint::metrology
