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
constexpr std::size_t kMostPatches = 1'000'000;

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

// take(point, normal, area) of n * n equal triangles.
template <typename Take>
void Divide(const Corners& corners, double area_mm2, int n, const Take& take) {
  const double share = area_mm2 / (static_cast<double>(n) * n);
  const auto at = [&](const Vector3d* values, double u, double v) -> Vector3d {
    return values[0] + u / n * (values[1] - values[0]) + v / n * (values[2] - values[0]);
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; i + j < n; ++j) {
      take(at(corners.points_mm, i + 1.0 / 3, j + 1.0 / 3), at(corners.normals, i + 1.0 / 3, j + 1.0 / 3), share);
      if (i + j + 1 < n)
        take(at(corners.points_mm, i + 2.0 / 3, j + 2.0 / 3), at(corners.normals, i + 2.0 / 3, j + 2.0 / 3), share);
    }
}

}  // namespace

absl::StatusOr<SurfacePatches> SurfacePatches::Make(const Surface& surface, double patch_mm) {
  if (!(patch_mm >= kLeastPatch_mm && patch_mm <= kGreatestPatch_mm)) return Refuse("patch_mm", patch_mm, "0.1 to 20");
  const double about = surface.area_mm2() / (patch_mm * patch_mm);
  if (!(about < kMostPatches))
    return Refuse("patch_mm", patch_mm,
                  "at least " + Rounded(std::sqrt(surface.area_mm2() / kMostPatches)) +
                      ": the surface would have more than a million patches");
  SurfacePatches made;
  made.patch_mm_ = patch_mm;
  made.centroid_mm_ = surface.centroid_mm();
  std::map<PatchKey, SurfacePatch> patches;
  const TriangleMesh& mesh = surface.mesh();
  SurfacePatch* last = nullptr;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Corners corners = CornersOf(mesh, t);
    const Vector3d one = corners.points_mm[1] - corners.points_mm[0],
                   other = corners.points_mm[2] - corners.points_mm[0];
    const double area_mm2 = one.cross(other).norm() / 2;
    if (!(area_mm2 > 0)) continue;
    const double longest_mm = std::max({one.norm(), other.norm(), (other - one).norm()});
    const int n = static_cast<int>(std::ceil(kSamplesOfPatch * longest_mm / patch_mm));
    Divide(corners, area_mm2, std::max(1, n), [&](const Vector3d& point_mm, const Vector3d& normal, double share_mm2) {
      const PatchKey key = PatchKeyOf(point_mm - made.centroid_mm_, normal, patch_mm);
      if (last == nullptr || last->key != key) last = &patches[key];
      last->key = key;
      last->area_mm2 += share_mm2;
      last->centre_mm += share_mm2 * point_mm;
      last->normal += share_mm2 * normal;
    });
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

std::uint32_t SurfacePatches::Of(PatchKey key) const {
  const auto found = index_.find(key);
  return found == index_.end() ? kNone : found->second;
}

}  // namespace sixpoint::metrology
