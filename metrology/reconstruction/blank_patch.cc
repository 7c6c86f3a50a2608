#include "metrology/reconstruction/blank_patch.h"

namespace sixpoint::metrology {

std::vector<BlankPatch> BlankPatchesOf(const DeviationField& field, const Surface& surface) {
  std::vector<BlankPatch> patches;
  for (std::size_t i = 0; i < field.surface->patches().size(); ++i) {
    const PatchDeviation& measured = field.patches[i];
    if (!measured.mean_mm) continue;
    const SurfacePatch& patch = field.surface->patches()[i];
    const SurfacePoint on = surface.Closest(patch.centre_mm);
    const Eigen::Vector3d normal = on.feature == SurfaceFeature::kFace ? on.normal : patch.normal;
    patches.push_back({on.point_mm + *measured.mean_mm * normal, normal, measured.standard_uncertainty_mm});
  }
  return patches;
}

}  // namespace sixpoint::metrology
