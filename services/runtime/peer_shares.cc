#include "services/runtime/peer_shares.h"

#include <algorithm>

#include "services/runtime/peer_address.h"

namespace sixpoint::runtime {
namespace {

using Clock = std::chrono::steady_clock;

// gRPC tells nobody that a call was cancelled: it has to be asked.
constexpr std::chrono::milliseconds kBetweenShareQuestions{100};

}  // namespace

std::optional<PeerShares::Share> PeerShares::Take(const std::string& grpc_peer) {
  return Take(grpc_peer, Clock::now(), [] { return false; });
}

std::optional<PeerShares::Share> PeerShares::Take(const std::string& grpc_peer, Clock::time_point until,
                                                  const std::function<bool()>& keep_going) {
  const std::string peer = PeerKey(grpc_peer);
  std::unique_lock<std::mutex> lock(mutex_);
  const auto self = waiting_.emplace(waiting_.end());
  self->peer = peer;
  bool is_its_turn = IsFirst(self) && HasRoom(peer);
  while (!is_its_turn && Clock::now() < until && keep_going()) {
    self->turn.wait_until(lock, std::min(until, Clock::now() + kBetweenShareQuestions));
    is_its_turn = IsFirst(self) && HasRoom(peer);
  }
  waiting_.erase(self);
  if (is_its_turn) ++count_[peer];
  WakeFirst(peer);
  if (!is_its_turn) return std::nullopt;
  return Share(this, peer);
}

bool PeerShares::IsFirst(std::list<Waiting>::const_iterator one) const {
  return std::none_of(waiting_.begin(), one, [&](const Waiting& before) { return before.peer == one->peer; });
}

bool PeerShares::HasRoom(const std::string& peer) const {
  const auto found = count_.find(peer);
  return found == count_.end() ? most_per_peer_ > 0 : found->second < most_per_peer_;
}

void PeerShares::WakeFirst(const std::string& peer) {
  const auto first =
      std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& one) { return one.peer == peer; });
  if (first != waiting_.end() && HasRoom(peer)) first->turn.notify_one();
}

void PeerShares::GiveBack(const std::string& peer) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = count_.find(peer);
  if (--found->second == 0) count_.erase(found);
  WakeFirst(peer);
}

}  // namespace sixpoint::runtime
