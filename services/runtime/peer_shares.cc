#include "services/runtime/peer_shares.h"

#include "services/runtime/peer_address.h"

namespace sixpoint::runtime {

std::optional<PeerShares::Share> PeerShares::Take(const std::string& grpc_peer) {
  const std::string peer = PeerKey(grpc_peer);
  const std::lock_guard<std::mutex> lock(mutex_);
  int& count = count_[peer];
  if (count >= most_per_peer_) return std::nullopt;
  ++count;
  return Share(this, peer);
}

void PeerShares::GiveBack(const std::string& peer) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = count_.find(peer);
  if (--found->second == 0) count_.erase(found);
}

}  // namespace sixpoint::runtime
