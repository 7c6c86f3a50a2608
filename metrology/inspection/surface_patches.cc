#include "metrology/inspection/surface_patches.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kSamplesOfPatch = 4;  // along an edge of a triangle
// Of memory: a map holds sums of each patch for each of its scans. Of time: slivers that are metres long have as many samples as wide triangles.
constexpr double kMostPatches = 100'000;
constexpr std::int64_t kMostSamples = 20'000'000;

struct Corners {
  Vector3d points_mm[3], normals[3];
};

Corners CornersOf(const TriangleMesh& mesh, std::size_t triangle) {
  Corners corners;
  for (std::size_t k = 0; k < 3; ++k) corners.points_mm[k] = mesh.vertices_mm[mesh.triangles[triangle][k]];
  const Vector3d flat =
      (corners.points_mm[1] - corners.points_mm[0]).cross(corners.points_mm[2] - corners.points_mm[0]).normalized();
  for (std::size_t k = 0; k < 3; ++k)
    corners.normals[k] = mesh.corner_normals.empty() ? flat : mesh.corner_normals[triangle][k].cast<double>();
  return corners;
}

// Calls take(point, normal, area) in steps of at most edge_mm along the triangle's longest edge and across it, so that slivers are sampled along their
// length alone. False where that would be more than *left.
template <typename Take>
bool Sample(const Corners& corners, double area_mm2, double edge_mm, std::int64_t* left, const Take& take) {
  std::size_t a = 0;
  double longest_mm = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double length_mm = (corners.points_mm[(k + 1) % 3] - corners.points_mm[k]).norm();
    if (!(length_mm > longest_mm)) continue;
    longest_mm = length_mm;
    a = k;
  }
  const std::size_t b = (a + 1) % 3, apex = (a + 2) % 3;
  const double along = std::ceil(longest_mm / edge_mm), across = std::ceil(2 * area_mm2 / longest_mm / edge_mm);
  if (!(along * across <= static_cast<double>(*left))) return false;
  *left -= static_cast<std::int64_t>(along * across);
  for (double v = 0.5 / across; v < 1; v += 1 / across) {
    for (double u = 0.5 / along; u < 1; u += 1 / along) {
      const auto at = [&](const Vector3d of[3]) -> Vector3d {
        return (1 - v) * ((1 - u) * of[a] + u * of[b]) + v * of[apex];
      };
      take(at(corners.points_mm), at(corners.normals), 2 * (1 - v) * area_mm2 / (along * across));
    }
  }
  return true;
}

}  // namespace

absl::StatusOr<SurfacePatches> SurfacePatches::Make(const Surface& surface, double patch_mm) {
  if (!(patch_mm >= kLeastPatch_mm && patch_mm <= kGreatestPatch_mm)) return Refuse("patch_mm", patch_mm, "0.1 to 20");
  if (!(surface.area_mm2() / (patch_mm * patch_mm) < kMostPatches))
    return Refuse("patch_mm", patch_mm,
                  "more than " + Rounded(std::sqrt(surface.area_mm2() / kMostPatches)) +
                      ": the surface would have more than 100000 patches");
  SurfacePatches made;
  made.patch_mm_ = patch_mm;
  made.centroid_mm_ = surface.centroid_mm();
  std::map<PatchKey, SurfacePatch> patches;
  const TriangleMesh& mesh = surface.mesh();
  SurfacePatch* last = nullptr;
  std::int64_t left = kMostSamples;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Corners corners = CornersOf(mesh, t);
    const Vector3d one = corners.points_mm[1] - corners.points_mm[0],
                   other = corners.points_mm[2] - corners.points_mm[0];
    const double area_mm2 = one.cross(other).norm() / 2;
    if (!(area_mm2 > 0)) continue;
    const bool sampled = Sample(corners, area_mm2, patch_mm / kSamplesOfPatch, &left,
                                [&](const Vector3d& point_mm, const Vector3d& normal, double share_mm2) {
                                  const PatchKey key = PatchKeyOf(point_mm - made.centroid_mm_, normal, patch_mm);
                                  if (last == nullptr || last->key != key) last = &patches[key];
                                  last->key = key;
                                  last->area_mm2 += share_mm2;
                                  last->centre_mm += share_mm2 * point_mm;
                                  last->normal += share_mm2 * normal;
                                });
    if (patches.size() > kMostPatches)
      return Refuse("patch_mm", patch_mm, "a greater one: the surface has more than 100000 patches");
    if (!sampled)
      return Refuse("patch_mm", patch_mm,
                    "a greater one: the surface's triangles are long, and cannot be sampled so finely");
  }
  for (auto& [key, patch] : patches) {
    patch.centre_mm /= patch.area_mm2;
    patch.normal.normalize();
    made.area_mm2_ += patch.area_mm2;
    made.index_.emplace(key, static_cast<std::uint32_t>(made.patches_.size()));
    made.patches_.push_back(patch);
  }
  return made;
}

bool SurfaceRegion::Has(const Eigen::Vector3d& centre_mm, const Eigen::Vector3d& normal) const {
  return !(minimum_mm && (centre_mm.array() < minimum_mm->array()).any()) &&
         !(maximum_mm && (centre_mm.array() > maximum_mm->array()).any()) &&
         !(facing && normal.dot(*facing) < std::cos(facing_within_rad));
}

std::vector<std::uint32_t> SurfacePatches::In(const SurfaceRegion& region) const {
  std::vector<std::uint32_t> in;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    if (region.Has(patches_[i].centre_mm, patches_[i].normal)) in.push_back(static_cast<std::uint32_t>(i));
  }
  return in;
}

std::uint32_t SurfacePatches::Of(PatchKey key) const {
  const auto found = index_.find(key);
  return found == index_.end() ? kNone : found->second;
}

}  // namespace sixpoint::metrology
