#include "services/gateway/used_tickets.h"

namespace sixpoint::gateway {

UsedTickets::Use UsedTickets::Take(const SignInTicket& ticket, const std::string& peer,
                                   std::chrono::system_clock::time_point now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  while (!peer_of_.empty() && now > peer_of_.begin()->first.first + SignInTickets::kLast) {
    const auto oldest = peer_of_.begin();
    if (const auto counted = count_.find(oldest->second); --counted->second == 0) count_.erase(counted);
    peer_of_.erase(oldest);
  }
  const Key key(ticket.begun, ticket.random);
  if (peer_of_.count(key) > 0) return Use::kAgain;
  const auto counted = count_.find(peer);
  const std::size_t of_peer = counted == count_.end() ? 0 : counted->second;
  if (peer_of_.size() >= most_ || of_peer >= most_of_peer_) return Use::kFull;
  peer_of_.emplace(key, peer);
  ++count_[peer];
  return Use::kFirst;
}

}  // namespace sixpoint::gateway
