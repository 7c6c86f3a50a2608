// The tickets whose codes were exchanged: each counts once, however often somebody sends it.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "services/gateway/sign_in_ticket.h"

namespace sixpoint::gateway {

// Thread-safe. One is forgotten when its ticket holds no longer. Where it has no room, nothing that it remembers is given up: a ticket could
// be used again then.
class UsedTickets {
 public:
  // About 4 MB. One address may be that of a whole house, and fills no more than a quarter: 7 sign-ins a second for ten minutes.
  static constexpr std::size_t kMost = 16384, kMostOfPeer = kMost / 4;

  enum class Use { kFirst, kAgain, kFull };
  explicit UsedTickets(std::size_t most = kMost, std::size_t most_of_peer = kMostOfPeer)
      : most_(most), most_of_peer_(most_of_peer) {}
  // peer: who sent it, by PeerOf (code_exchange.h). kFull: it was not used, and may not be.
  Use Take(const SignInTicket& ticket, const std::string& peer, std::chrono::system_clock::time_point now);

 private:
  // When it began, which a ticket says itself, and its random: in the order in which they are forgotten.
  using Key = std::pair<std::chrono::system_clock::time_point, std::string>;

  const std::size_t most_, most_of_peer_;
  std::mutex mutex_;
  std::map<Key, std::string> peer_of_;
  std::map<std::string, std::size_t> count_;  // of the peers in peer_of_
};

}  // namespace sixpoint::gateway
