#include "metrology/reconstruction/design_places.h"

#include "metrology/inspection/surface_patches.h"
#include "metrology/parallel/loops.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {

absl::StatusOr<DesignPlaces> SampleDesign(std::shared_ptr<const Surface> surface, double spacing_mm, int threads) {
  if (surface == nullptr) return Refuse("surface", "", "the design's surface");
  const absl::StatusOr<SurfacePatches> patches = SurfacePatches::Make(*surface, spacing_mm);
  if (!patches.ok()) {
    const std::vector<Violation> violations = ViolationsOf(patches.status());
    if (violations.empty()) return patches.status();
    return Refuse("spacing_mm", violations[0].value, violations[0].wanted);
  }
  DesignPlaces design{std::move(surface), spacing_mm, {}};
  design.places.resize(patches->patches().size());
  ForEachChunk(design.places.size(), 1024, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SurfacePatch& patch = patches->patches()[i];
      const SurfacePoint on = design.surface->Closest(patch.centre_mm);
      // At a sharp edge the patch's own face is meant, not the mean of both.
      const bool is_smooth = on.feature == SurfaceFeature::kFace;
      design.places[i] = {on.point_mm, is_smooth ? on.normal : patch.normal, patch.area_mm2, on.triangle};
    }
  });
  return design;
}

}  // namespace sixpoint::metrology
