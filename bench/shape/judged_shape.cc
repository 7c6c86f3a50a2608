#include "bench/shape/judged_shape.h"

#include <algorithm>
#include <cmath>

#include "metrology/reconstruction/place_grid.h"

namespace sixpoint::bench {
namespace {

using metrology::RegionKind;

constexpr double kBesideMachined_mm = 1.6;  // the step is judged so far beside what is cut

}  // namespace

void JudgedShape::Take(const JudgedShape& other) {
  allowance_mm = std::min(allowance_mm, other.allowance_mm);
  between_mm = std::min(between_mm, other.between_mm);
  beyond_band_mm = std::max(beyond_band_mm, other.beyond_band_mm);
  fixed_mm = std::max(fixed_mm, other.fixed_mm);
  step_mm = std::max(step_mm, other.step_mm);
  true_step_mm = std::max(true_step_mm, other.true_step_mm);
  kink_rad = std::max(kink_rad, other.kink_rad);
}

JudgedShape Judge(const Vane& vane, const BladeCase& blade, const metrology::Reconstruction& made) {
  JudgedShape judged;
  const auto shape = testing::MovedSurface(*vane.surface, *made.deformation);
  const double blend_mm = BladeOptions().blend_mm;
  metrology::PlaceGrid fixed(blend_mm), machined(kBesideMachined_mm);
  for (const metrology::DesignPlace& place : vane.places.places) {
    const RegionKind kind = blade.regions[RegionAt(blade.regions, place.point_mm, place.normal)].kind;
    if (kind == RegionKind::kFixed) fixed.Add(place.point_mm, place.normal);
    if (kind == RegionKind::kMachined) machined.Add(place.point_mm, place.normal);
  }
  // In the strip beside fixed surface the allowance rises from none.
  const auto beyond_mm = [&](const testing::BlankPoint& point, double allowance_mm, double distance_mm) {
    return fixed.Has(point.place_mm, point.normal, 0) ? distance_mm + 0.002 : distance_mm - allowance_mm;
  };
  for (const testing::BlankPoint& point : testing::BlankPoints(*vane.surface, vane.patches.places, blade.blank)) {
    const auto& region = blade.regions[RegionAt(blade.regions, point.place_mm, point.normal)];
    if (region.kind != RegionKind::kMachined) continue;
    const double distance_mm = shape->Closest(point.point_mm).signed_distance_mm;
    judged.allowance_mm = std::min(judged.allowance_mm, beyond_mm(point, region.allowance_mm, distance_mm));
  }
  for (const testing::BlankPoint& point : testing::BlankPoints(*vane.surface, vane.judged.places, blade.blank)) {
    const auto& region = blade.regions[RegionAt(blade.regions, point.place_mm, point.normal)];
    if (region.kind == RegionKind::kDatum) continue;
    const double distance_mm = shape->Closest(point.point_mm).signed_distance_mm;
    const Eigen::Vector3d moved_mm = point.place_mm + *made.deformation->DisplacementAt(point.place_mm);
    const metrology::SurfacePoint off = vane.surface->Closest(moved_mm);
    if (off.normal.dot(point.normal) > 0.5)
      judged.beyond_band_mm = std::max(
          {judged.beyond_band_mm, region.lower_mm - off.signed_distance_mm, off.signed_distance_mm - region.upper_mm});
    if (region.kind == RegionKind::kFixed) {
      judged.fixed_mm = std::max(judged.fixed_mm, std::abs(distance_mm));
      if (machined.Has(point.place_mm, point.normal, 0))
        judged.true_step_mm = std::max(judged.true_step_mm, std::abs(distance_mm));
    } else {
      judged.between_mm = std::min(judged.between_mm, beyond_mm(point, region.allowance_mm, distance_mm));
    }
  }
  judged.step_mm = made.worst_step_mm;
  judged.kink_rad = made.worst_kink_rad;
  return judged;
}

}  // namespace sixpoint::bench
