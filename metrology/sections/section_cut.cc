#include "metrology/sections/section_cut.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "metrology/mesh/weld.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kOutlinePieces = 3000;  // of an outline

// One triangle's piece of the cut, from one edge of the mesh to another.
struct CutPiece {
  std::uint64_t edges[2];
  Vector3d ends_mm[2];
  std::uint32_t triangle;
};

std::uint64_t EdgeKey(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b);
}

std::vector<CutPiece> PiecesOf(const TriangleMesh& mesh, const Eigen::Isometry3d& section_from_part) {
  const std::vector<std::uint32_t> alike = FirstAlike(0, mesh.vertices_mm);
  std::vector<double> heights;
  for (const Vector3d& vertex_mm : mesh.vertices_mm) heights.push_back((section_from_part * vertex_mm).z());
  std::vector<CutPiece> pieces;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    CutPiece piece;
    int ends = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t a = alike[mesh.triangles[t][k]], b = alike[mesh.triangles[t][(k + 1) % 3]];
      if (a > b) std::swap(a, b);  // so that both triangles of an edge cut it at the same place
      // A vertex in the plane counts as above it: every triangle is cut in two edges or in none.
      if ((heights[a] >= 0) == (heights[b] >= 0) || ends == 2) continue;
      const double part = heights[a] / (heights[a] - heights[b]);
      piece.edges[ends] = EdgeKey(a, b);
      piece.ends_mm[ends++] = mesh.vertices_mm[a] + part * (mesh.vertices_mm[b] - mesh.vertices_mm[a]);
    }
    piece.triangle = t;
    if (ends == 2 && piece.edges[0] != piece.edges[1]) pieces.push_back(piece);
  }
  return pieces;
}

// Moves within the plane onto the curved surface.
Vector2d OnSurface(const Surface& surface, const Eigen::Isometry3d& part_from_section, Vector2d point_mm,
                   std::uint32_t triangle) {
  const Eigen::Matrix3d section_from_part = part_from_section.linear().transpose();
  Vector2d start_mm = point_mm;
  for (int turn = 0; turn < 4; ++turn) {
    const SurfacePoint nearest = surface.Closest(part_from_section * Vector3d(point_mm.x(), point_mm.y(), 0), triangle);
    if (nearest.feature != SurfaceFeature::kFace) return start_mm;
    const Vector2d across = (section_from_part * nearest.normal).head<2>();
    if (across.norm() < 0.2) return start_mm;
    point_mm -= nearest.signed_distance_mm / across.squaredNorm() * across;
    if (std::abs(nearest.signed_distance_mm) < 1e-6) break;
  }
  const double chordal_mm = 1e-3 * surface.mesh().chordal_error_um + 0.05;
  return (point_mm - start_mm).norm() < chordal_mm ? point_mm : start_mm;
}

}  // namespace

absl::StatusOr<std::vector<std::vector<Vector2d>>> CutSurface(const Surface& surface,
                                                              const Eigen::Isometry3d& part_from_section) {
  const Eigen::Isometry3d section_from_part = part_from_section.inverse();
  const std::vector<CutPiece> pieces = PiecesOf(surface.mesh(), section_from_part);
  if (pieces.empty())
    return Refuse("plane.origin_mm", part_from_section.translation().z(), "a plane that meets the part");
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> at_edge;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    for (const std::uint64_t edge : pieces[i].edges) at_edge[edge].push_back(i);
  std::vector<bool> used(pieces.size(), false);
  std::vector<std::pair<double, std::vector<Vector2d>>> loops;
  for (std::size_t first = 0; first < pieces.size(); ++first) {
    if (used[first]) continue;
    std::vector<std::pair<std::size_t, int>> walk;  // piece, and which of its ends comes first
    double length_mm = 0;
    std::size_t at = first;
    int from = 0;
    for (;;) {
      used[at] = true;
      walk.emplace_back(at, from);
      length_mm += (pieces[at].ends_mm[1] - pieces[at].ends_mm[0]).norm();
      const std::uint64_t edge = pieces[at].edges[1 - from];
      const std::vector<std::size_t>& here = at_edge[edge];
      if (here.size() != 2) return Refuse("plane", "an outline that ends at a rim of the surface", "closed outlines");
      const std::size_t next = here[0] == at ? here[1] : here[0];
      if (used[next]) break;
      from = pieces[next].edges[0] == edge ? 0 : 1;
      at = next;
    }
    std::vector<Vector2d> loop_mm;
    for (const auto& [index, begin] : walk) {
      const Vector3d a = section_from_part * pieces[index].ends_mm[begin];
      const Vector3d b = section_from_part * pieces[index].ends_mm[1 - begin];
      // Neither end itself: there two facets meet, maybe in a sharp edge.
      const double count = std::floor((b - a).norm() / length_mm * kOutlinePieces) + ((b - a).norm() > 1e-4 ? 1 : 0);
      for (double k = 0.5; k < count; ++k)
        loop_mm.push_back(
            OnSurface(surface, part_from_section, (a + k / count * (b - a)).head<2>(), pieces[index].triangle));
    }
    loops.emplace_back(length_mm, std::move(loop_mm));
  }
  std::stable_sort(loops.begin(), loops.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::vector<Vector2d>> found;
  for (auto& [length_mm, loop_mm] : loops) found.push_back(std::move(loop_mm));
  return found;
}

}  // namespace sixpoint::metrology
