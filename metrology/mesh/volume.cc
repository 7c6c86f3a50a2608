#include "metrology/mesh/volume.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "metrology/mesh/edges.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using DirectedEdge = std::pair<std::uint32_t, std::uint32_t>;  // from, to

// Edges that no triangle runs back along, sorted.
std::vector<DirectedEdge> BorderOf(const std::vector<TriangleCorners>& triangles) {
  std::vector<DirectedEdge> border;
  ForEachEdge(EdgeSidesOf(triangles), [&](const EdgeSide* sides, std::size_t count) {
    const auto forward = std::count_if(sides, sides + count, [](const EdgeSide& side) { return side.forward; });
    if (forward != 0 && static_cast<std::size_t>(forward) != count) return;
    border.insert(border.end(), count, {sides->from(), sides->to()});
  });
  std::sort(border.begin(), border.end());
  return border;
}

// Follows the border from a start, vertex to vertex, until it ends or meets what is used.
std::vector<DirectedEdge> LoopFrom(std::size_t start, const std::vector<DirectedEdge>& border,
                                   std::vector<bool>* used) {
  std::vector<DirectedEdge> loop;
  for (std::size_t at = start; at < border.size() && !(*used)[at];) {
    (*used)[at] = true;
    loop.push_back(border[at]);
    at = static_cast<std::size_t>(std::lower_bound(border.begin(), border.end(), DirectedEdge{loop.back().second, 0}) -
                                  border.begin());
    while (at < border.size() && (*used)[at] && border[at].first == loop.back().second) ++at;
    if (at < border.size() && border[at].first != loop.back().second) break;
  }
  return loop;
}

}  // namespace

double SignedVolumeOfClosed(const Points& vertices_mm, const std::vector<TriangleCorners>& triangles,
                            const Vector3d& about_mm) {
  double six_volumes = 0;
  for (const auto& [a, b, c] : triangles)
    six_volumes += (vertices_mm[a] - about_mm).dot((vertices_mm[b] - about_mm).cross(vertices_mm[c] - about_mm));
  return six_volumes / 6;
}

double SignedVolume(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return 0;
  // About a vertex of the mesh: parts stand metres from their origin.
  const Vector3d origin = mesh.vertices_mm[mesh.triangles[0][0]];
  const std::vector<DirectedEdge> border = BorderOf(mesh.triangles);
  std::vector<bool> used(border.size(), false);
  double six_volumes = 0;  // of the caps
  for (std::size_t start = 0; start < border.size(); ++start) {
    const std::vector<DirectedEdge> loop = LoopFrom(start, border, &used);
    Vector3d centroid = Vector3d::Zero();
    for (const auto& [from, to] : loop)
      centroid += (mesh.vertices_mm[from] - origin) / static_cast<double>(loop.size());
    for (const auto& [from, to] : loop)
      six_volumes += centroid.dot((mesh.vertices_mm[to] - origin).cross(mesh.vertices_mm[from] - origin));
  }
  return SignedVolumeOfClosed(mesh.vertices_mm, mesh.triangles, origin) + six_volumes / 6;
}

SurfaceMoments MomentsOf(const Points& vertices_mm, const std::vector<TriangleCorners>& triangles) {
  SurfaceMoments moments;
  double second = 0;
  Vector3d first = Vector3d::Zero();
  for (const TriangleCorners& corners : triangles) {
    const Vector3d &p = vertices_mm[corners[0]], &q = vertices_mm[corners[1]], &r = vertices_mm[corners[2]];
    const double area = 0.5 * (q - p).cross(r - p).norm();
    moments.area_mm2 += area;
    first += area / 3 * (p + q + r);
    second += area / 12 * (p.squaredNorm() + q.squaredNorm() + r.squaredNorm() + (p + q + r).squaredNorm());
  }
  moments.centroid_mm = first / moments.area_mm2;
  moments.radius_of_gyration_mm =
      std::sqrt(std::max(0.0, second / moments.area_mm2 - moments.centroid_mm.squaredNorm()));
  return moments;
}

}  // namespace sixpoint::metrology
