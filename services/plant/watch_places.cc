#include "services/plant/watch_places.h"

namespace sixpoint::plant {

std::optional<WatchPlaces::Place> WatchPlaces::Take(const std::string& identity) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto own = of_identity_.find(identity);
  const int own_count = own == of_identity_.end() ? 0 : own->second;
  if (in_all_ >= limits_.in_all || own_count >= limits_.per_identity) return std::nullopt;
  ++in_all_;
  ++of_identity_[identity];
  return Place(this, identity);
}

void WatchPlaces::GiveBack(const std::string& identity) {
  const std::lock_guard<std::mutex> lock(mutex_);
  --in_all_;
  const auto own = of_identity_.find(identity);
  if (--own->second == 0) of_identity_.erase(own);
}

}  // namespace sixpoint::plant
