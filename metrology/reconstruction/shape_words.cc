#include "metrology/reconstruction/shape_words.h"

#include "metrology/frames/angles.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

const char* NameOf(LimitKind kind) {
  switch (kind) {
    case LimitKind::kStock:
      return "stock";
    case LimitKind::kTolerance:
      return "tolerance";
    case LimitKind::kFixed:
      return "following";
    case LimitKind::kDatum:
      return "datum";
  }
  return "";
}

}  // namespace

std::string UnseenText(const std::vector<ShapeRegion>& regions, const std::vector<RegionFinding>& findings,
                       double least_seen_part) {
  std::string unseen;
  for (std::size_t r = 0; r < regions.size(); ++r) {
    if (regions[r].kind == RegionKind::kDatum || findings[r].seen_part >= least_seen_part) continue;
    unseen += (unseen.empty() ? "" : ", ") + Rounded(100 * findings[r].seen_part) + " % of " + regions[r].name;
  }
  if (unseen.empty()) return unseen;
  return "nothing is known of stock that was not seen: seen " + unseen + ", want at least " +
         Rounded(100 * least_seen_part) + " % of each machined or fixed region";
}

std::string MissedText(const std::vector<ShapeRegion>& regions, const ShapeMisses& misses) {
  std::size_t kind = 0;
  for (std::size_t k = 1; k < kLimitKinds; ++k)
    if (misses.missed_mm[k] > misses.missed_mm[kind]) kind = k;
  return std::string(NameOf(static_cast<LimitKind>(kind))) + " of region " + regions[misses.region[kind]].name +
         " is missed by " + Rounded(1e3 * misses.missed_mm[kind]) + " um";
}

std::string RegionMissedText(const ShapeRegion& region, const std::string& how, double missed_mm) {
  return "region " + region.name + " is missed by " + how + Rounded(1e3 * missed_mm) + " um";
}

std::string KinkText(const std::vector<ShapeRegion>& regions, const ShapeTransition& transition) {
  return "the transition of region " + regions[transition.kink_region].name + " kinks by " +
         Rounded(transition.kink_rad * kDegPerRad) + " deg";
}

absl::Status TooCoarseAt(double spacing_mm, const std::string& what) {
  return Refuse("options.finest_spacing_mm", Rounded(spacing_mm) + " mm is too coarse: " + what, "a finer lattice");
}

}  // namespace sixpoint::metrology
