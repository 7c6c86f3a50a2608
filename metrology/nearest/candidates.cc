#include "metrology/nearest/candidates.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

// Distances are compared in single precision first; what is nearer than the best by less than its rounding is measured
// exactly. Longer and thinner triangles round worse.
constexpr float kRounding = 4e-7f;

}  // namespace

float ToleranceOf(const TriangleShape& shape, const Eigen::Vector3f& corner_mm, float width_mm) {
  const float reach = corner_mm.lpNorm<1>() + width_mm;
  const float size = std::max(std::abs(shape.bx) + std::abs(shape.by) + std::abs(shape.bz),
                              std::abs(shape.cx) + std::abs(shape.cy) + std::abs(shape.cz));
  return shape.rounding * (reach + size);
}

TriangleShape ShapeOf(const Eigen::Vector3d& ab, const Eigen::Vector3d& ac) {
  const Eigen::Vector3d normal = ab.cross(ac);
  const double twice_area = normal.norm();
  const Eigen::Vector3f b = ab.cast<float>(), c = ac.cast<float>(), n = (normal / twice_area).cast<float>();
  TriangleShape shape{};
  shape.bx = b.x(), shape.by = b.y(), shape.bz = b.z();
  shape.cx = c.x(), shape.cy = c.y(), shape.cz = c.z();
  shape.nx = n.x(), shape.ny = n.y(), shape.nz = n.z();
  const Eigen::Vector3f v = (ac.cross(normal) / (twice_area * twice_area)).cast<float>();
  const Eigen::Vector3f w = (normal.cross(ab) / (twice_area * twice_area)).cast<float>();
  shape.vx = v.x(), shape.vy = v.y(), shape.vz = v.z();
  shape.wx = w.x(), shape.wy = w.y(), shape.wz = w.z();
  const double thinness = std::sqrt(ab.squaredNorm() * ac.squaredNorm()) / twice_area;  // about 1 for a good triangle
  shape.rounding = static_cast<float>(kRounding * (1 + thinness));
  return shape;
}

}  // namespace sixpoint::metrology
