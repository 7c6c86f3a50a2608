#include "bench/all_triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;

double SegmentSquared(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d along = b - a;
  return (p - a - std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0) * along).squaredNorm();
}

}  // namespace

double SignedDistanceByAllTriangles(const metrology::TriangleMesh& mesh, const Vector3d& p) {
  double least = std::numeric_limits<double>::infinity(), seen = 0;
  for (const auto& corners : mesh.triangles) {
    const Vector3d &a = mesh.vertices_mm[corners[0]], &b = mesh.vertices_mm[corners[1]],
                   &c = mesh.vertices_mm[corners[2]];
    const Vector3d normal = (b - a).cross(c - a);
    const double length = normal.norm();
    if (!(length > 0)) continue;
    const bool above = normal.dot((b - a).cross(p - a)) >= 0 && normal.dot((c - b).cross(p - b)) >= 0 &&
                       normal.dot((a - c).cross(p - c)) >= 0;
    least =
        std::min(least, above ? std::pow(normal.dot(p - a) / length, 2)
                              : std::min({SegmentSquared(p, a, b), SegmentSquared(p, b, c), SegmentSquared(p, c, a)}));
    const Vector3d pa = a - p, pb = b - p, pc = c - p;
    const double la = pa.norm(), lb = pb.norm(), lc = pc.norm();
    seen += 2 * std::atan2(pa.dot(pb.cross(pc)), la * lb * lc + pa.dot(pb) * lc + pb.dot(pc) * la + pc.dot(pa) * lb);
  }
  return seen > 2 * M_PI ? -std::sqrt(least) : std::sqrt(least);
}

}  // namespace sixpoint::bench
