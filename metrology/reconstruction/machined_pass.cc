#include "metrology/reconstruction/machined_pass.h"

#include <algorithm>
#include <cmath>

#include "metrology/reconstruction/surface_foot.h"

namespace sixpoint::metrology {
namespace {

constexpr double kLeastCut_mm = 0.01;     // that says how much a tool gives way
constexpr double kLeastSpread_mm = 0.03;  // of what was removed, to tell an offset from giving way
constexpr std::size_t kLeastCutPatches = 20;
constexpr double kGreatestShare = 0.9;  // a tool that gives way by more cuts nothing

void Least(double value, std::optional<double>* least) {
  *least = least->has_value() ? std::min(**least, value) : value;
}

// What was left over what was removed, by least squares.
void LearnTool(const std::vector<const PassPatch*>& cut, PassRegion* region) {
  if (cut.size() < kLeastCutPatches) return;
  const auto count = static_cast<double>(cut.size());
  double removed = 0, rest = 0, spread = 0, both = 0;
  for (const PassPatch* patch : cut) {
    removed += *patch->removed_mm / count;
    rest += patch->rest_mm / count;
  }
  for (const PassPatch* patch : cut) {
    spread += (*patch->removed_mm - removed) * (*patch->removed_mm - removed) / count;
    both += (*patch->removed_mm - removed) * (patch->rest_mm - rest) / count;
  }
  // Where as much was removed everywhere, all of it may be either: giving way is taken, which commands less.
  const double share = spread > kLeastSpread_mm * kLeastSpread_mm ? both / spread : rest / removed;
  region->deflection_share = std::clamp(share, 0.0, kGreatestShare);
  region->offset_mm = rest - *region->deflection_share * removed;
}

void SetSeenParts(const DesignPlaces& design, const std::vector<ShapeRegion>& regions, const PlaceGrid& seen,
                  std::vector<PassRegion>* found) {
  std::vector<double> area_mm2(regions.size()), seen_mm2(regions.size());
  for (const DesignPlace& place : design.places) {
    const std::size_t r = RegionAt(regions, place.point_mm, place.normal);
    if (r >= regions.size()) continue;
    area_mm2[r] += place.area_mm2;
    if (seen.Has(place.point_mm, place.normal, kSameWallCosine)) seen_mm2[r] += place.area_mm2;
  }
  for (std::size_t r = 0; r < regions.size(); ++r)
    (*found)[r].seen_part = area_mm2[r] > 0 ? seen_mm2[r] / area_mm2[r] : 0;
}

void Look(const ShapeRegion& limits, const PassPatch& patch, double guard_mm,
          const std::optional<double>& greatest_rest_mm, PassRegion* region) {
  ++region->patch_count;
  if (limits.kind == RegionKind::kDatum) return;
  Least(patch.deviation_mm() - guard_mm - limits.lower_mm, &region->least_lower_spare_mm);
  Least(limits.upper_mm - patch.deviation_mm() - guard_mm, &region->least_upper_spare_mm);
  if (limits.kind != RegionKind::kMachined) return;
  if (greatest_rest_mm) Least(*greatest_rest_mm - patch.rest_mm - guard_mm, &region->least_upper_spare_mm);
  Least(patch.rest_mm, &region->least_rest_mm);
  region->greatest_rest_mm = std::max(region->greatest_rest_mm.value_or(patch.rest_mm), patch.rest_mm);
  region->mean_rest_mm = region->mean_rest_mm.value_or(0) + patch.rest_mm;
}

// Where a limit is certainly exceeded, which no pass mends.
bool IsBeyondHelp(const ShapeRegion& limits, const PassPatch& patch, double guard_mm) {
  if (limits.kind == RegionKind::kDatum) return false;
  if (patch.deviation_mm() + guard_mm < limits.lower_mm) return true;
  return limits.kind == RegionKind::kFixed && patch.deviation_mm() - guard_mm > limits.upper_mm;
}

struct Doubts {
  std::string beyond_help, not_told, to_cut;  // the first region of each
};

void Decide(const Doubts& doubts, JudgedPass* judged) {
  if (!doubts.beyond_help.empty()) {
    judged->outcome = PassOutcome::kScrap;
    judged->remark = doubts.beyond_help + ": beyond its profile tolerance where no pass mends it";
  } else if (!doubts.not_told.empty()) {
    judged->outcome = PassOutcome::kNotDetermined;
    judged->remark = doubts.not_told;
  } else if (!doubts.to_cut.empty()) {
    judged->outcome = PassOutcome::kAnotherPass;
    judged->remark = doubts.to_cut + ": material stands higher than it may, or may do so";
  } else {
    judged->outcome = PassOutcome::kDone;
  }
}

void First(const std::string& text, std::string* kept) {
  if (kept->empty()) *kept = text;
}

}  // namespace

JudgedPass JudgePass(const DesignPlaces& design, const std::vector<ShapeRegion>& regions,
                     const std::vector<PassPatch>& patches, const PassOptions& options) {
  JudgedPass judged;
  judged.regions.resize(regions.size());
  Doubts doubts;
  std::vector<std::vector<const PassPatch*>> cut(regions.size());
  PlaceGrid seen(options.patch_mm);
  for (const PassPatch& patch : patches) {
    if (patch.region >= regions.size()) continue;
    const ShapeRegion& limits = regions[patch.region];
    const double guard_mm = options.coverage_factor * patch.standard_uncertainty_mm;
    seen.Add(patch.place_mm, patch.normal);
    Look(limits, patch, guard_mm, options.greatest_rest_mm, &judged.regions[patch.region]);
    if (IsBeyondHelp(limits, patch, guard_mm)) First(limits.name, &doubts.beyond_help);
    if (limits.kind == RegionKind::kMachined && patch.removed_mm && *patch.removed_mm > kLeastCut_mm + guard_mm)
      cut[patch.region].push_back(&patch);
  }
  SetSeenParts(design, regions, seen, &judged.regions);
  for (std::size_t r = 0; r < regions.size(); ++r) {
    PassRegion& region = judged.regions[r];
    if (region.mean_rest_mm) *region.mean_rest_mm /= static_cast<double>(region.patch_count);
    if (regions[r].kind == RegionKind::kDatum) continue;
    LearnTool(cut[r], &region);
    const bool is_machined = regions[r].kind == RegionKind::kMachined;
    // What is not cut was seen when the shape was found.
    if (is_machined && region.seen_part < options.least_seen_part)
      First(regions[r].name + ": too little of it was seen", &doubts.not_told);
    if (region.least_lower_spare_mm.value_or(0) < 0)
      First(regions[r].name + ": within its uncertainty it is too low", &doubts.not_told);
    if (region.least_upper_spare_mm.value_or(0) < 0)
      First(is_machined ? regions[r].name : regions[r].name + ": within its uncertainty it is too high",
            is_machined ? &doubts.to_cut : &doubts.not_told);
  }
  Decide(doubts, &judged);
  return judged;
}

PassCompensation::PassCompensation(const std::vector<ShapeRegion>& regions, const std::vector<PassRegion>& found,
                                   const std::vector<PassPatch>& patches, double reach_mm)
    : regions_(regions), found_(found), reach_mm_(reach_mm), grid_(reach_mm) {
  for (const PassPatch& patch : patches) {
    if (patch.region >= regions.size() || regions[patch.region].kind != RegionKind::kMachined) continue;
    grid_.Add(patch.place_mm, patch.normal);
    rest_mm_.push_back(patch.rest_mm);
  }
}

double PassCompensation::At(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& normal, double moved_mm) const {
  const std::size_t r = RegionAt(regions_, place_mm, normal);
  if (r >= regions_.size() || regions_[r].kind != RegionKind::kMachined || !found_[r].offset_mm) return 0;
  double weight = 0, rest = 0;
  grid_.EachNear(place_mm, normal, kSameWallCosine, [&](std::size_t i, const Eigen::Vector3d&, double distance_mm) {
    const double share = 1 - distance_mm / reach_mm_, one = share * share;
    weight += one;
    rest += one * rest_mm_[i];
  });
  if (!(weight > 0)) return 0;
  const double deeper_mm = *found_[r].offset_mm + *found_[r].deflection_share * (rest / weight);
  return std::clamp(deeper_mm, std::min(0.0, moved_mm - regions_[r].upper_mm),
                    std::max(0.0, moved_mm - regions_[r].lower_mm));
}

}  // namespace sixpoint::metrology
