#include "metrology/reconstruction/blank_patch.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "metrology/parallel/loops.h"
#include "metrology/reconstruction/surface_foot.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kPointChunk = 8192;

// Of the points of one patch: a plane through their distances over the tangents of the patch.
struct PlaneSums {
  double count = 0, squares = 0;
  Matrix3d matrix = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero(), outward = Vector3d::Zero();
};

}  // namespace

absl::StatusOr<std::vector<BlankPatch>> GatherBlank(const Surface& surface, const SurfacePatches& patches,
                                                    const Points& points_mm, const Points& outward,
                                                    const GatherOptions& options) {
  if (points_mm.size() != outward.size())
    return Refuse("outward", std::to_string(outward.size()), std::to_string(points_mm.size()) + ", one of each point");
  struct Found {
    std::uint32_t patch = SurfacePatches::kNone;
    double distance_mm = 0;
    Vector3d place_mm;
  };
  std::vector<Found> found(points_mm.size());
  std::vector<std::uint8_t> bad(ChunkCount(points_mm.size(), kPointChunk), 0);
  ForEachChunk(
      points_mm.size(), kPointChunk, options.threads, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
        std::optional<SurfaceFoot> last;
        for (std::size_t i = begin; i < end; ++i) {
          if (!points_mm[i].allFinite() || !outward[i].allFinite()) {
            bad[chunk] = 1;
            continue;
          }
          const auto foot =
              FootOf(surface, nullptr, points_mm[i], outward[i], options.farthest_mm, last ? &*last : nullptr);
          if (!foot || foot->feature != SurfaceFeature::kFace) continue;
          last = foot;
          found[i] = {patches.Of(patches.KeyOf(foot->place_mm, foot->normal)), foot->distance_mm, foot->place_mm};
        }
      });
  for (const std::uint8_t is_bad : bad)
    if (is_bad != 0) return Refuse("points_mm", "not finite", "finite points and directions");
  std::vector<PlaneSums> sums(patches.patches().size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].patch == SurfacePatches::kNone) continue;
    const SurfacePatch& patch = patches.patches()[found[i].patch];
    const Vector3d one = patch.normal.unitOrthogonal(), from_mm = found[i].place_mm - patch.centre_mm;
    const Vector3d row(1, one.dot(from_mm), patch.normal.cross(one).dot(from_mm));
    PlaneSums& sum = sums[found[i].patch];
    sum.count += 1;
    sum.squares += found[i].distance_mm * found[i].distance_mm;
    sum.matrix += row * row.transpose();
    sum.right += found[i].distance_mm * row;
    sum.outward += outward[i];
  }
  std::vector<BlankPatch> gathered;
  for (std::size_t p = 0; p < sums.size(); ++p) {
    const PlaneSums& sum = sums[p];
    if (!(sum.count >= std::max(4, options.least_points))) continue;
    const Eigen::LDLT<Matrix3d> factor(sum.matrix);
    const Vector3d plane = factor.solve(sum.right);
    const double height_variance = factor.solve(Vector3d::UnitX()).x();
    const double rest = std::max(0.0, sum.squares - plane.dot(sum.right)) / (sum.count - 3);
    // Points on a line hold no plane.
    if (!plane.allFinite() || !(height_variance > 0 && height_variance < 1)) continue;
    const SurfacePatch& patch = patches.patches()[p];
    const SurfacePoint on = surface.Closest(patch.centre_mm);
    if (on.feature != SurfaceFeature::kFace) continue;
    gathered.push_back(
        {on.point_mm + plane[0] * on.normal, sum.outward.normalized(), std::sqrt(rest * height_variance)});
  }
  return gathered;
}

}  // namespace sixpoint::metrology
