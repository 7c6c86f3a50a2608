#include "services/correction/next_pass.h"

#include <utility>

#include "metrology/reconstruction/place_grid.h"
#include "metrology/reconstruction/surface_foot.h"
#include "services/correction/reconstruct.h"

namespace sixpoint::correction {
namespace {

// What was removed of each: by the nearest patch that stood above the same wall before.
void SetRemoved(const std::vector<metrology::PassPatch>& before, double patch_mm,
                std::vector<metrology::PassPatch>* after) {
  metrology::PlaceGrid grid(patch_mm);
  for (const metrology::PassPatch& patch : before) grid.Add(patch.place_mm, patch.normal);
  for (metrology::PassPatch& patch : *after) {
    double nearest_mm = patch_mm;
    grid.EachNear(patch.place_mm, patch.normal, metrology::kSameWallCosine,
                  [&](std::size_t i, const Eigen::Vector3d&, double distance_mm) {
                    if (!(distance_mm < nearest_mm)) return;
                    nearest_mm = distance_mm;
                    patch.removed_mm = before[i].rest_mm - patch.rest_mm;
                  });
  }
}

}  // namespace

absl::StatusOr<LeftByPass> LookAtPass(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                                      const Shape& shape, const std::vector<metrology::BlankPatch>& before,
                                      const std::optional<double>& greatest_rest_mm, int threads,
                                      const runtime::Caller& caller) {
  auto measured = MeasureSurface(scans, blade, shape.method, threads, caller);
  if (!measured.ok()) return measured.status();
  LeftByPass left;
  left.patches = std::move(measured->patches);
  left.counts = measured->counts;
  std::vector<std::size_t> index;
  std::vector<metrology::PassPatch> above = AboveShape(shape, left.patches, threads, &index);
  SetRemoved(AboveShape(shape, before, threads), shape.method.patch_mm, &above);
  left.rest_mm.resize(left.patches.size());
  left.region_of.assign(left.patches.size(), shape.regions.size());
  for (std::size_t i = 0; i < above.size(); ++i) {
    left.rest_mm[index[i]] = above[i].rest_mm;
    left.region_of[index[i]] = above[i].region;
  }
  metrology::PassOptions options;
  options.coverage_factor = shape.method.coverage_factor;
  options.patch_mm = shape.method.patch_mm;
  options.greatest_rest_mm = greatest_rest_mm;
  left.judged = metrology::JudgePass(shape.design, shape.regions, above, options);
  return left;
}

}  // namespace sixpoint::correction
