// The true surface over a triangle: a cubic height field over its plane that has given normals at the corners (as PN
// triangles, Vlachos et al. 2001). Off a smooth surface by the fourth power of the triangle's size along its edges and the
// third inside, where facets are off by the second.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "metrology/mesh/patch_numbers.h"

namespace sixpoint::metrology {

class CubicPatch {
 public:
  struct Foot {
    Eigen::Vector3d point_mm, normal;
  };

  // Absent where a normal turns away from the facet's, or the patch would stand higher than a tenth of its longest edge.
  static std::optional<CubicPatch> Over(const std::array<Eigen::Vector3d, 3>& corners_mm,
                                        const std::array<Eigen::Vector3d, 3>& normals);

  // At barycentric coordinates of the plane, outside the triangle too.
  Foot At(const Eigen::Vector3d& barycentric) const {
    const auto [point_mm, normal] = PointOf(numbers_, {barycentric[0], barycentric[1], barycentric[2]});
    return {Eigen::Vector3d(point_mm), Eigen::Vector3d(normal).normalized()};
  }
  // Of a point's foot in the plane.
  Eigen::Vector3d Barycentric(const Eigen::Vector3d& point_mm) const {
    const Eigen::Vector3d by_mm = point_mm - Eigen::Vector3d(numbers_.corner_mm);
    double step[3];
    StepOf(numbers_, {by_mm[0], by_mm[1], by_mm[2]}, step);
    return Eigen::Vector3d(1, 0, 0) + Eigen::Vector3d(step);
  }
  const PatchNumbers<double>& numbers() const { return numbers_; }

 private:
  PatchNumbers<double> numbers_;
};

}  // namespace sixpoint::metrology
