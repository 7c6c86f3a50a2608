// What one peer may hold at most of something that all share.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace sixpoint::runtime {

// Thread-safe; outlives its shares.
class PeerShares {
 public:
  explicit PeerShares(int most_per_peer) : most_per_peer_(most_per_peer) {}

  // Given back at its end.
  class Share {
   public:
    Share(PeerShares* shares, std::string peer) : shares_(shares), peer_(std::move(peer)) {}
    Share(Share&& other) noexcept : shares_(std::exchange(other.shares_, nullptr)), peer_(std::move(other.peer_)) {}
    Share& operator=(Share&&) = delete;
    ~Share() {
      if (shares_ != nullptr) shares_->GiveBack(peer_);
    }

   private:
    PeerShares* shares_;
    std::string peer_;
  };
  // grpc_peer: as grpc::ServerContext::peer() names it; who is one peer, peer_address.h says. None where it holds as many as it may.
  std::optional<Share> Take(const std::string& grpc_peer);
  // The same, and waited for: first come, first served among the calls of one peer.
  std::optional<Share> Take(const std::string& grpc_peer, std::chrono::steady_clock::time_point until,
                            const std::function<bool()>& keep_going);
  int most_per_peer() const { return most_per_peer_; }

 private:
  struct Waiting {
    std::string peer;
    std::condition_variable turn;
  };
  void GiveBack(const std::string& peer);
  bool IsFirst(std::list<Waiting>::const_iterator one) const;
  bool HasRoom(const std::string& peer) const;
  void WakeFirst(const std::string& peer);

  const int most_per_peer_;
  std::mutex mutex_;
  std::map<std::string, int> count_;  // of those who hold any
  std::list<Waiting> waiting_;
};

}  // namespace sixpoint::runtime
