// The true surface over a triangle: a cubic height field over its plane that has given normals at the corners (as PN
// triangles, Vlachos et al. 2001). Off a smooth surface by the fourth power of the triangle's size along its edges and the
// third inside, where facets are off by the second.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

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
    double slope_1, slope_2;
    const double height_mm = Height(barycentric, &slope_1, &slope_2);
    return {corner_mm_ + barycentric[1] * edge_1_mm_ + barycentric[2] * edge_2_mm_ + height_mm * unit_normal_,
            (unit_normal_ - slope_1 * dual_1_ - slope_2 * dual_2_).normalized()};
  }
  // Of a point's foot in the plane.
  Eigen::Vector3d Barycentric(const Eigen::Vector3d& point_mm) const {
    return Eigen::Vector3d(1, 0, 0) + BarycentricStep(point_mm - corner_mm_);
  }
  Eigen::Vector3d BarycentricStep(const Eigen::Vector3d& by_mm) const {
    const double b1 = dual_1_.dot(by_mm), b2 = dual_2_.dot(by_mm);
    return {-b1 - b2, b1, b2};
  }

 private:
  double Height(const Eigen::Vector3d& b, double* slope_1, double* slope_2) const;

  Eigen::Vector3d corner_mm_, unit_normal_;
  Eigen::Vector3d dual_1_, dual_2_;  // barycentric coordinates 1 and 2 of x: dual . (x - corner)
  Eigen::Vector3d edge_1_mm_, edge_2_mm_;
  std::array<double, 7> height_mm_;  // Bezier: 001 011 | 112 122 | 220 200 pairs, then the middle
};

}  // namespace sixpoint::metrology
