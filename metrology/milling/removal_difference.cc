#include "metrology/milling/removal_difference.h"

#include <algorithm>
#include <string>

#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

// A pass is closed: an open path goes back the way it came, which cuts nothing more.
RecontourPath ThereAndBack(const std::vector<ToolPlace>& places) {
  RecontourPass pass;
  pass.places = places;
  for (std::size_t i = places.size(); i-- > 2;) pass.places.push_back(places[i - 1]);
  return {{std::move(pass)}};
}

}  // namespace

absl::StatusOr<RemovalDifference> CompareRemoval(const CutBeside& first, const CutBeside& second, const BallMill& mill,
                                                 double depth_mm, double touch_mm, int threads) {
  if (first.dexels.size() != second.dexels.size())
    return Refuse("second.dexels", std::to_string(second.dexels.size()), "as many as the first has");
  if (first.places.size() != second.places.size())
    return Refuse("second.places", std::to_string(second.places.size()), "as many as the first has");
  const Removal before = Remove(first.dexels, ThereAndBack(first.places), mill, depth_mm, threads);
  const Removal after = Remove(second.dexels, ThereAndBack(second.places), mill, depth_mm, threads);
  RemovalDifference difference;
  for (std::size_t d = 0; d < before.top_mm.size(); ++d) {
    const double left_mm = before.top_mm[d], now_mm = after.top_mm[d];
    if (left_mm >= first.dexels[d].top_mm && now_mm >= second.dexels[d].top_mm) continue;
    ++difference.compared_count;
    difference.deepest_mm = std::max(difference.deepest_mm, std::min(left_mm, 0.0) - now_mm);
    if (left_mm <= touch_mm) difference.most_rest_mm = std::max(difference.most_rest_mm, now_mm - left_mm);
  }
  return difference;
}

}  // namespace sixpoint::metrology
