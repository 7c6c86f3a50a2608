#include "metrology/surface/seams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <utility>

#include "metrology/frames/angles.h"
#include "metrology/mesh/volume.h"
#include "metrology/mesh/weld.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kNone = NearestTriangle::kNone;
// Faces that meet at less than this are not a sharp edge; corner normals that differ by less belong to one smooth face.
const double kSharpCosine = std::cos(20 * kPi / 180);
const double kSmoothCosine = std::cos(1 * kPi / 180);

}  // namespace

Vector3d Seams::FacetNormal(std::uint32_t triangle) const {
  const TriangleCorners& c = mesh_.triangles[triangle];
  const Vector3d& a = vertices_mm_[c[0]];
  return (vertices_mm_[c[1]] - a).cross(vertices_mm_[c[2]] - a).normalized();
}

std::vector<TriangleCorners> Seams::SumNormals() {
  std::vector<TriangleCorners> with_area(mesh_.triangles.size(), TriangleCorners{});
  std::vector<Vector3d> sums(vertices_mm_.size(), Vector3d::Zero());
  for (std::uint32_t t = 0; t < with_area.size(); ++t) {
    const Vector3d normal = FacetNormal(t);
    if (!(normal.squaredNorm() > 0.5)) continue;  // degenerate: has no part in the topology
    const TriangleCorners& c = mesh_.triangles[t];
    for (std::size_t i = 0; i < 3; ++i) with_area[t][i] = welded_[c[i]];
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d& at = vertices_mm_[c[i]];
      const Vector3d to_p = (vertices_mm_[with_area[t][(i + 1) % 3]] - at).normalized();
      const Vector3d to_q = (vertices_mm_[with_area[t][(i + 2) % 3]] - at).normalized();
      sums[with_area[t][i]] += std::acos(std::clamp(to_p.dot(to_q), -1.0, 1.0)) * normal;
    }
  }
  vertex_normals_.resize(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) vertex_normals_[v] = sums[v].normalized().cast<float>();
  return with_area;
}

// By corner normals where the mesh knows them, else by facets, which never meet smoothly.
std::uint8_t Seams::SeamBetween(const EdgeSide& one, const EdgeSide& other) const {
  std::uint8_t seam = one.forward == other.forward ? kCreased | kSharp : kSmooth;
  if (mesh_.corner_normals.empty()) {
    seam |= kCreased;
    if (FacetNormal(one.triangle).dot(FacetNormal(other.triangle)) < kSharpCosine) seam |= kSharp;
    return seam;
  }
  for (const std::uint32_t vertex : {one.low, one.high}) {
    const auto normal_at = [&](const EdgeSide& side) {
      const TriangleCorners& c = mesh_.triangles[side.triangle];
      const int i = welded_[c[0]] == vertex ? 0 : welded_[c[1]] == vertex ? 1 : 2;
      return mesh_.corner_normals[side.triangle][i];
    };
    const float cosine = normal_at(one).dot(normal_at(other));
    if (!(cosine > kSmoothCosine)) seam |= kCreased;
    if (!(cosine > kSharpCosine)) seam |= kSharp;
  }
  return seam;
}

void Seams::SetSeam(const EdgeSide* sides, std::size_t count, std::vector<SharpEdges::Edge>* sharp) {
  std::uint8_t seam = kOpen;
  if (count == 2) {
    beyond_[sides[0].triangle][sides[0].opposite] = sides[1].triangle;
    beyond_[sides[1].triangle][sides[1].opposite] = sides[0].triangle;
    seam = SeamBetween(sides[0], sides[1]);
  }
  for (std::size_t k = 0; k < count; ++k) seams_[sides[k].triangle][sides[k].opposite] = seam;
  vertex_seams_[sides->low] |= seam;
  vertex_seams_[sides->high] |= seam;
  if (seam & (kSharp | kOpen))
    sharp->push_back({vertices_mm_[sides->low], vertices_mm_[sides->high] - vertices_mm_[sides->low]});
}

absl::Status Seams::Find(const Vector3d& middle_mm) {
  welded_ = FirstAlike(0, vertices_mm_);
  const std::vector<EdgeSide> all = EdgeSidesOf(SumNormals());
  seams_.assign(mesh_.triangles.size(), {kOpen, kOpen, kOpen});
  beyond_.assign(mesh_.triangles.size(), {kNone, kNone, kNone});
  vertex_seams_.assign(vertices_mm_.size(), kSmooth);
  std::vector<SharpEdges::Edge> sharp;
  std::size_t branching = 0, open = 0;
  Vector3d branching_mm = Vector3d::Zero();
  ForEachEdge(all, [&](const EdgeSide* sides, std::size_t count) {
    if (count == 1) ++open;
    if (count > 2 && branching++ == 0)
      branching_mm = middle_mm + 0.5 * (vertices_mm_[sides->low] + vertices_mm_[sides->high]);
    SetSeam(sides, count, &sharp);
  });
  if (branching > 0) {
    std::ostringstream found;
    found << branching << " edges with more than two triangles, the first at (" << branching_mm.x() << ", "
          << branching_mm.y() << ", " << branching_mm.z() << ") mm";
    return Refuse("surface.triangles", found.str(), "at most two: the boundary of one body");
  }
  // An open sheet has a side all the same, but none to be checked.
  const double volume_mm3 = open == 0 ? SignedVolumeOfClosed(vertices_mm_, mesh_.triangles, Vector3d::Zero()) : 0;
  if (volume_mm3 < 0)
    return Refuse("surface.triangles", "inside out, volume " + Rounded(volume_mm3) + " mm3",
                  "corners counter-clockwise seen from outside");
  sharp_ = SharpEdges(std::move(sharp));
  FindNearEdges();
  return absl::OkStatus();
}

// From the triangles that have a corner on an edge over their neighbours, as far as it reaches.
void Seams::FindNearEdges() {
  const auto& faces = mesh_.triangles;
  near_edge_.assign(faces.size(), 0);
  std::vector<std::uint32_t> left;
  for (std::uint32_t t = 0; t < faces.size(); ++t) {
    for (const std::uint32_t v : faces[t])
      if (vertex_seams_[welded_[v]] & (kSharp | kOpen)) near_edge_[t] = 1;
    if (near_edge_[t]) left.push_back(t);
  }
  while (!left.empty()) {
    const std::uint32_t t = left.back();
    left.pop_back();
    for (const std::uint32_t next : beyond_[t]) {
      if (next == kNone || near_edge_[next]) continue;
      const TriangleCorners& c = faces[next];
      const Vector3d middle = (vertices_mm_[c[0]] + vertices_mm_[c[1]] + vertices_mm_[c[2]]) / 3;
      double squared = 0;
      for (const std::uint32_t v : c) squared = std::max(squared, (vertices_mm_[v] - middle).squaredNorm());
      if (std::isinf(sharp_.Distance(middle, std::sqrt(squared) + kEdgeReachMm))) continue;
      near_edge_[next] = 1;
      left.push_back(next);
    }
  }
}

std::uint8_t Seams::SeamAt(const NearestTriangle& nearest) const {
  const int part = static_cast<int>(nearest.part);
  if (part >= 4) return vertex_seams_[welded_[mesh_.triangles[nearest.triangle][part - 4]]];
  return part >= 1 ? seams_[nearest.triangle][part - 1] : std::uint8_t{kSmooth};
}

Vector3d Seams::PseudoNormal(const NearestTriangle& nearest) const {
  const std::uint32_t t = nearest.triangle;
  const int part = static_cast<int>(nearest.part);
  if (part >= 4) return vertex_normals_[welded_[mesh_.triangles[t][part - 4]]].cast<double>();
  const Vector3d own = FacetNormal(t);
  const std::uint32_t next = part >= 1 ? beyond_[t][part - 1] : kNone;
  return next == kNone ? own : (own + FacetNormal(next)).normalized();
}

double Seams::EdgeDistance(std::uint32_t triangle, const Vector3d& point_mm) const {
  return near_edge_[triangle] ? sharp_.Distance(point_mm, kEdgeReachMm) : std::numeric_limits<double>::infinity();
}

std::size_t Seams::memory_bytes() const {
  const auto of = [](const auto& list) { return list.capacity() * sizeof(list[0]); };
  return of(welded_) + of(vertex_normals_) + of(vertex_seams_) + of(seams_) + of(beyond_) + of(near_edge_) +
         sharp_.memory_bytes();
}

}  // namespace sixpoint::metrology
