#include "metrology/mesh/skin.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <sstream>
#include <utility>
#include <vector>

#include "metrology/mesh/edges.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

// Edges of a kind that a skin does not have, for a refusal.
struct Faults {
  std::size_t count = 0;
  const EdgeSide* first = nullptr;
  void Add(const EdgeSide* sides) {
    if (count++ == 0) first = sides;
  }
  absl::Status Refusal(const TriangleMesh& mesh, const char* what, const char* wanted) const {
    const Eigen::Vector3d middle_mm = 0.5 * (mesh.vertices_mm[first->low] + mesh.vertices_mm[first->high]);
    std::ostringstream found;
    found << count << ' ' << what << ", the first at (" << middle_mm.x() << ", " << middle_mm.y() << ", "
          << middle_mm.z() << ") mm";
    return Refuse("mesh.edges", found.str(), wanted);
  }
};

// Vertices that lead to another of their group, the first to itself.
class Groups {
 public:
  explicit Groups(std::size_t count) : leads_to_(count) { std::iota(leads_to_.begin(), leads_to_.end(), 0); }
  std::uint32_t FirstOf(std::uint32_t v) {
    while (leads_to_[v] != v) v = leads_to_[v] = leads_to_[leads_to_[v]];
    return v;
  }
  void Join(std::uint32_t one, std::uint32_t other) {
    const auto [low, high] = std::minmax({FirstOf(one), FirstOf(other)});
    leads_to_[high] = low;
  }

 private:
  std::vector<std::uint32_t> leads_to_;
};

}  // namespace

bool IsClosed(const TriangleMesh& mesh) {
  bool closed = !mesh.triangles.empty();
  ForEachEdge(EdgeSidesOf(mesh.triangles),
              [&](const EdgeSide* sides, std::size_t count) { closed = closed && IsWhole(sides, count); });
  return closed;
}

absl::Status CheckOneSided(const TriangleMesh& mesh) {
  const std::vector<EdgeSide> all = EdgeSidesOf(mesh.triangles);
  Faults branching, turned;
  ForEachEdge(all, [&](const EdgeSide* sides, std::size_t count) {
    if (count > 2) branching.Add(sides);
    if (count == 2 && !IsWhole(sides, count)) turned.Add(sides);
  });
  if (branching.count > 0)
    return branching.Refusal(mesh, "with more than two triangles", "at most two: the boundary of one body");
  if (turned.count > 0)
    return turned.Refusal(mesh, "between triangles turned against each other",
                          "all corners counter-clockwise seen from outside");
  return absl::OkStatus();
}

void TurnOver(TriangleMesh* mesh) {
  for (TriangleCorners& corners : mesh->triangles) std::swap(corners[1], corners[2]);
  for (auto& normals : mesh->corner_normals) {
    std::swap(normals[1], normals[2]);
    for (Eigen::Vector3f& normal : normals) normal = -normal;
  }
}

MeshGaps GapsOf(const TriangleMesh& mesh) {
  MeshGaps gaps;
  std::vector<TriangleCorners> with_area;
  for (const TriangleCorners& corners : mesh.triangles) {
    const Eigen::Vector3d &a = mesh.vertices_mm[corners[0]], &b = mesh.vertices_mm[corners[1]],
                          &c = mesh.vertices_mm[corners[2]];
    if ((b - a).cross(c - a).squaredNorm() > 0)
      with_area.push_back(corners);
    else
      ++gaps.degenerate_triangle_count;
  }
  Groups rims(mesh.vertices_mm.size());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> open;
  ForEachEdge(EdgeSidesOf(with_area), [&](const EdgeSide* sides, std::size_t count) {
    if (count == 1) open.emplace_back(sides->from(), sides->to());
  });
  std::sort(open.begin(), open.end());
  std::vector<std::uint32_t> on_rim;
  for (const auto& [from, to] : open) {
    gaps.open_rim_length_mm += (mesh.vertices_mm[to] - mesh.vertices_mm[from]).norm();
    rims.Join(from, to);
    on_rim.push_back(from);
  }
  for (std::uint32_t& vertex : on_rim) vertex = rims.FirstOf(vertex);
  std::sort(on_rim.begin(), on_rim.end());
  gaps.open_rim_count = std::unique(on_rim.begin(), on_rim.end()) - on_rim.begin();
  return gaps;
}

}  // namespace sixpoint::metrology
