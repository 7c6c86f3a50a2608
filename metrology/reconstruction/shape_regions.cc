#include "metrology/reconstruction/shape_regions.h"

#include <algorithm>
#include <cmath>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

std::string Field(std::size_t region, const std::string& name = {}) {
  return "regions[" + std::to_string(region) + "]" + (name.empty() ? "" : "." + name);
}

bool IsFinite(const SurfaceRegion& where) {
  return !(where.minimum_mm && !where.minimum_mm->allFinite()) &&
         !(where.maximum_mm && !where.maximum_mm->allFinite()) &&
         !(where.facing && !(std::abs(where.facing->norm() - 1) < 1e-6)) && std::isfinite(where.facing_within_rad);
}

bool AreAlike(const ShapeRegion& one, const ShapeRegion& other) {
  return one.kind == other.kind && one.allowance_mm == other.allowance_mm && one.lower_mm == other.lower_mm &&
         one.upper_mm == other.upper_mm;
}

}  // namespace

absl::Status CheckRegions(const std::vector<ShapeRegion>& regions) {
  if (regions.empty() || regions.size() > 255) return Refuse("regions", std::to_string(regions.size()), "1 to 255");
  Refusals refusals;
  std::size_t rests = 0, machined = 0;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const ShapeRegion& region = regions[i];
    rests += region.rest;
    machined += region.kind == RegionKind::kMachined;
    if (!IsFinite(region.where)) refusals.Add(Refuse(Field(i, "where"), "not finite", "finite corners, a unit facing"));
    if (region.kind == RegionKind::kDatum) continue;
    if (!(region.lower_mm < region.upper_mm))
      refusals.Add(
          Refuse(Field(i, "lower_mm"), region.lower_mm, "less than the upper, " + NumberText(region.upper_mm)));
    if (!(region.lower_mm >= -kGreatestBand_mm && region.lower_mm <= kGreatestBand_mm))
      refusals.Add(Refuse(Field(i, "lower_mm"), region.lower_mm, "-5 to 5"));
    if (!(region.upper_mm >= -kGreatestBand_mm && region.upper_mm <= kGreatestBand_mm))
      refusals.Add(Refuse(Field(i, "upper_mm"), region.upper_mm, "-5 to 5"));
    if (!(region.allowance_mm >= 0 && region.allowance_mm <= kGreatestBand_mm))
      refusals.Add(Refuse(Field(i, "allowance_mm"), region.allowance_mm, "0 to 5"));
  }
  if (rests > 1) refusals.Add(Refuse("regions", std::to_string(rests) + " with the rest", "one at most"));
  if (machined == 0)
    refusals.Add(Refuse("regions", "none machined", "at least one: what is not cut is not reconstructed"));
  return refusals.status();
}

absl::StatusOr<std::vector<std::uint8_t>> AssignRegions(const DesignPlaces& design,
                                                        const std::vector<ShapeRegion>& regions) {
  std::vector<std::uint8_t> region_of(design.places.size());
  std::size_t in_none = 0, first = 0;
  for (std::size_t i = 0; i < design.places.size(); ++i) {
    const DesignPlace& place = design.places[i];
    std::size_t found = regions.size();
    for (std::size_t r = 0; r < regions.size(); ++r) {
      if (regions[r].rest || !regions[r].where.Has(place.point_mm, place.normal)) continue;
      if (found == regions.size()) found = r;
      if (!AreAlike(regions[found], regions[r]))
        return Refuse(Field(r),
                      "overlaps " + Field(found) + " at (" + Rounded(place.point_mm.x()) + ", " +
                          Rounded(place.point_mm.y()) + ", " + Rounded(place.point_mm.z()) + ")",
                      "a region of the same kind and limits, or none, at each place");
    }
    if (found == regions.size()) found = RegionAt(regions, place.point_mm, place.normal);
    if (found == regions.size() && in_none++ == 0) first = i;
    region_of[i] = static_cast<std::uint8_t>(std::min<std::size_t>(found, 255));
  }
  if (in_none > 0) {
    const Vector3d& at_mm = design.places[first].point_mm;
    return Refuse("regions",
                  std::to_string(in_none) + " places in none, one at (" + Rounded(at_mm.x()) + ", " +
                      Rounded(at_mm.y()) + ", " + Rounded(at_mm.z()) + ")",
                  "regions that have the whole surface, or one with the rest");
  }
  return region_of;
}

std::size_t RegionAt(const std::vector<ShapeRegion>& regions, const Vector3d& place_mm, const Vector3d& normal) {
  std::size_t rest = regions.size();
  for (std::size_t r = 0; r < regions.size(); ++r) {
    if (regions[r].rest)
      rest = r;
    else if (regions[r].where.Has(place_mm, normal))
      return r;
  }
  return rest;
}

}  // namespace sixpoint::metrology
