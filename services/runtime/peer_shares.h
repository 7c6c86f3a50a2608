// What one peer may hold at most of something that all share.
#pragma once

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
  int most_per_peer() const { return most_per_peer_; }

 private:
  void GiveBack(const std::string& peer);

  const int most_per_peer_;
  std::mutex mutex_;
  std::map<std::string, int> count_;  // of those who hold any
};

}  // namespace sixpoint::runtime
