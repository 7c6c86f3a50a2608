#include "metrology/reconstruction/stock_cuts.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

constexpr double kTurned = 0.999;  // cosine: 2.6 deg

bool AsksStock(const DisplacementLimit& limit) {
  return limit.most_kind == LimitKind::kStock && std::isfinite(limit.most_mm);
}

}  // namespace

void StockCuts::Take(const DisplacementLimit& cut, std::size_t own) {
  cuts_.push_back(cut);
  own_of_.push_back(own);
}

void StockCuts::TakeTurned(const std::vector<DisplacementLimit>& now) {
  if (cuts_.size() > now.size()) Clear();
  for (std::size_t i = 0; is_on_ && i < std::min(before_.size(), now.size()); ++i)
    if (AsksStock(before_[i]) && before_[i].direction.dot(now[i].direction) < kTurned) Take(before_[i], i);
  before_ = now;
}

void StockCuts::TakeMissed(const std::vector<DisplacementLimit>& there, const FreeFormDeformation& end,
                           double more_than_mm) {
  is_on_ = true;
  for (std::size_t i = 0; i < there.size(); ++i) {
    if (!AsksStock(there[i])) continue;
    const Eigen::Vector3d displacement_mm = DisplacementOf(end.lattice(), end.controls_mm(), there[i].at);
    if (there[i].direction.dot(displacement_mm) - there[i].most_mm > more_than_mm) Take(there[i], i);
  }
}

void StockCuts::Clear() {
  cuts_.clear();
  own_of_.clear();
  is_on_ = from_start_;
}

void StockCuts::AppendTo(std::vector<DisplacementLimit>* limits) const {
  limits->insert(limits->end(), cuts_.begin(), cuts_.end());
}

std::vector<LimitPush> StockCuts::Owned(const std::vector<LimitPush>& pushes, std::size_t own_count) const {
  std::vector<LimitPush> owned = pushes;
  for (LimitPush& push : owned)
    if (push.limit >= own_count) push.limit = own_of_[push.limit - own_count];
  std::stable_sort(owned.begin(), owned.end(), [](const LimitPush& one, const LimitPush& other) {
    return one.limit != other.limit ? one.limit < other.limit : one.most < other.most;
  });
  std::vector<LimitPush> summed;
  for (const LimitPush& push : owned) {
    if (!summed.empty() && summed.back().limit == push.limit && summed.back().most == push.most)
      summed.back().force += push.force;
    else
      summed.push_back(push);
  }
  return summed;
}

}  // namespace sixpoint::metrology
