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

std::uint32_t ListCandidates(std::vector<TriangleTree::Within>* found, std::vector<std::uint32_t>* items,
                             std::vector<float>* group_distance) {
  std::sort(found->begin(), found->end(), [](const TriangleTree::Within& x, const TriangleTree::Within& y) {
    return x.distance != y.distance ? x.distance < y.distance : x.item < y.item;
  });
  const std::size_t groups = (found->size() + kCandidateGroup - 1) / kCandidateGroup;
  for (std::size_t g = 0; g < groups; ++g) {
    group_distance->push_back(static_cast<float>((*found)[g * kCandidateGroup].distance * (1 - 1e-6)));
    for (std::size_t i = g * kCandidateGroup; i < (g + 1) * kCandidateGroup; ++i)
      items->push_back((*found)[std::min(i, found->size() - 1)].item);
  }
  return static_cast<std::uint32_t>(groups);
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
