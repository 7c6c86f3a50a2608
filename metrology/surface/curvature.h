// How a surface bends at a point, from points on it nearby and their normals.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

namespace sixpoint::metrology {

// Principal curvatures: positive where the surface falls away from its tangent plane on the inner side, as a ball's does
// (1 / radius). Not finite on a sharp edge, a corner or a rim, where there is none.
struct SurfaceCurvature {
  double greatest_per_mm = std::numeric_limits<double>::quiet_NaN();
  double least_per_mm = std::numeric_limits<double>::quiet_NaN();
  // Unit tangent along which the surface bends by greatest_per_mm; any tangent where both are equal.
  Eigen::Vector3d greatest_direction = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
};

struct OrientedPoint {
  Eigen::Vector3d point_mm, normal;  // outward, unit
};

// At a place on the surface or very near it: from the cubic over a plane there that meets points and normals best (a jet of
// third order, Cazals and Pouget 2005, with the normals as Goldfeather and Interrante 2004), nearer ones weighing more. Off
// by the square of their distance; where the bend itself changes within it, as in blends of small radius, by that change.
// Not finite where too few points, or points on a line, leave it open.
SurfaceCurvature CurvatureFrom(const std::vector<OrientedPoint>& nearby, const OrientedPoint& at);

}  // namespace sixpoint::metrology
