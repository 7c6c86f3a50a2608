#include "metrology/nearest/nearest_triangle.h"

namespace sixpoint::metrology {

// Ericson, Real-Time Collision Detection, 5.1.5.
void TakeNearer(const Points& vertices, const IndexedTriangle& item, const Eigen::Vector3d& query,
                NearestTriangle* best) {
  const Eigen::Vector3d &a = vertices[item.corners[0]], ab = vertices[item.corners[1]] - a,
                        ac = vertices[item.corners[2]] - a, ap = query - a;
  const double abab = ab.squaredNorm(), abac = ab.dot(ac), acac = ac.squaredNorm();
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  const double d3 = d1 - abab, d4 = d2 - abac, d5 = d1 - abac, d6 = d2 - acac;
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  double v, w;
  TrianglePart part;
  if (d1 <= 0 && d2 <= 0) {
    v = w = 0;
    part = TrianglePart::kCorner0;
  } else if (d3 >= 0 && d4 <= d3) {
    v = 1;
    w = 0;
    part = TrianglePart::kCorner1;
  } else if (d6 >= 0 && d5 <= d6) {
    v = 0;
    w = 1;
    part = TrianglePart::kCorner2;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    v = d1 / abab;
    w = 0;
    part = TrianglePart::kEdge2;
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    v = 0;
    w = d2 / acac;
    part = TrianglePart::kEdge1;
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    v = 1 - w;
    part = TrianglePart::kEdge0;
  } else {
    const double scale = 1 / (va + vb + vc);
    v = vb * scale;
    w = vc * scale;
    part = TrianglePart::kInside;
  }
  const double distance_squared = (ap - v * ab - w * ac).squaredNorm();
  const NearestTriangle found{item.triangle, distance_squared, {1 - v - w, v, w}, part, &item};
  if (IsNearer(found, *best)) *best = found;
}

}  // namespace sixpoint::metrology
