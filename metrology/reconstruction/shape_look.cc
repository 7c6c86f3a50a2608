// What a reconstruction measures beside a deformation. A signed distance changes by no more than its place moves, so that what had room and has
// hardly moved is not measured anew.
#include <cmath>
#include <limits>

#include "metrology/parallel/loops.h"
#include "metrology/reconstruction/shape_problem.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kTiny_mm = 1e-5;   // off the design: too little to have a direction
constexpr double kStill_mm = 1e-6;  // no figure shows it
// With so much room, nothing is missed: beside kPlentyOfStock_mm.
constexpr double kPlentyOfBand_mm = 0.02, kPlentyOfTube = 0.4;

}  // namespace

DisplacedPlace ShapeProblem::BandOf(const Vector3d& place_mm, const Vector3d& normal, std::uint32_t triangle,
                                    const Vector3d& displacement_mm) const {
  DisplacedPlace band{normal, displacement_mm, normal.dot(displacement_mm)};
  if (displacement_mm.squaredNorm() == 0) return band;
  const Vector3d moved_mm = place_mm + displacement_mm;
  const SurfacePoint found = design_.surface->Closest(moved_mm, triangle);
  // Nearer to another wall than to its own: then the way along its own normal counts.
  if (!IsSameWall(found.normal, normal)) return band;
  band.off_mm = found.signed_distance_mm;
  if (found.feature == SurfaceFeature::kFace)
    band.direction = found.normal;
  else if (std::abs(band.off_mm) > kTiny_mm)
    band.direction = (moved_mm - found.point_mm) / band.off_mm;
  return band;
}

bool ShapeProblem::IsBandDue(std::size_t place, double moved_mm, LookFor look_for) const {
  if (look_for != LookFor::kMissed || moved_mm <= kStill_mm) return moved_mm > kStill_mm;
  const ShapeRegion& region = regions_[region_of_[place]];
  if (region.kind == RegionKind::kDatum) return true;
  const double off_mm = look_.bands[place].off_mm;
  return std::min(off_mm - region.lower_mm, region.upper_mm - off_mm) < kGoesAlong * moved_mm + kPlentyOfBand_mm;
}

bool ShapeProblem::IsPatchDue(std::size_t patch, double moved_mm, LookFor look_for) const {
  if (look_for != LookFor::kMissed || moved_mm <= kStill_mm) return moved_mm > kStill_mm;
  if (look_.region_of_patch[patch] == regions_.size()) return true;
  const double distance_mm = look_.feet[patch]->distance_mm, along_mm = kGoesAlong * moved_mm;
  if (Is(patch, RegionKind::kFixed)) return (1 - kPlentyOfTube) * Tube_mm(patch) - std::abs(distance_mm) < along_mm;
  if (!Is(patch, RegionKind::kMachined)) return false;
  const ShapeRegion& region = regions_[look_.region_of_patch[patch]];
  const double off_mm = look_.patch_bands[patch].off_mm;
  return distance_mm - look_.wanted_mm[patch] < along_mm + kPlentyOfStock_mm ||
         std::min(off_mm - region.lower_mm, region.upper_mm - off_mm) < along_mm + kPlentyOfBand_mm;
}

void ShapeProblem::LookAtPatch(std::size_t patch, const FreeFormDeformation* deformation, const SurfaceFoot* near) {
  const BlankPatch& seen = blank_[patch];
  std::optional<SurfaceFoot>& foot = look_.feet[patch];
  foot = FootOf(*design_.surface, deformation, seen.point_mm, seen.normal, options_.greatest_stock_mm, near);
  if (!foot) return;
  // What was fixed stays it; a machined patch may slide along.
  if (!Is(patch, RegionKind::kFixed)) {
    look_.region_of_patch[patch] = RegionAt(regions_, foot->place_mm, foot->design_normal);
    if (Is(patch, RegionKind::kFixed) && deformation != nullptr) look_.region_of_patch[patch] = regions_.size();
  }
  look_.wanted_mm[patch] = 0;
  look_.cut_part[patch] = 1;
  if (!Is(patch, RegionKind::kMachined)) return;
  look_.patch_bands[patch] = BandOf(foot->place_mm, foot->design_normal, foot->triangle, foot->displacement_mm);
  const Wanted wanted = WantedAt(*foot, regions_[look_.region_of_patch[patch]], seen.standard_uncertainty_mm);
  look_.cut_part[patch] = wanted.cut_part;
  look_.wanted_mm[patch] = wanted.wanted_mm;
}

void ShapeProblem::LookAt(const FreeFormDeformation* deformation, LookFor look_for) {
  const auto displacement = [&](const Vector3d& place_mm) -> Vector3d {
    if (deformation == nullptr) return Vector3d::Zero();
    return deformation->DisplacementAt(place_mm).value_or(Vector3d::Zero());
  };
  if (deformation == nullptr) {
    look_.feet.assign(blank_.size(), std::nullopt);
    look_.region_of_patch.assign(blank_.size(), regions_.size());
    look_.bands.assign(design_.places.size(), {Vector3d::Zero(), Vector3d::Constant(std::nan("")), 0});
  }
  if (look_for != LookFor::kFeet)
    ForEachChunk(look_.bands.size(), kChunk, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const DesignPlace& place = design_.places[i];
        const Vector3d now_mm = displacement(place.point_mm);
        if (deformation == nullptr || IsBandDue(i, (now_mm - look_.bands[i].displacement_mm).norm(), look_for))
          look_.bands[i] = BandOf(place.point_mm, place.normal, place.triangle, now_mm);
      }
    });
  ForEachChunk(blank_.size(), kChunk, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) {
      const std::optional<SurfaceFoot> last = look_.feet[j];
      if (last && !IsPatchDue(j, (displacement(last->place_mm) - last->displacement_mm).norm(), look_for)) continue;
      LookAtPatch(j, deformation, last ? &*last : nullptr);
    }
  });
  if (deformation != nullptr) return;
  first_feet_ = look_.feet;
  for (std::size_t j = 0; j < blank_.size(); ++j)
    about_machined_[j] = look_.feet[j] && Is(j, RegionKind::kFixed) &&
                         machined_places_.Has(look_.feet[j]->place_mm, look_.feet[j]->design_normal, 0);
}

}  // namespace sixpoint::metrology
