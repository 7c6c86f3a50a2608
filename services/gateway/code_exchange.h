// A code that the identity provider gave a person becomes his ID token, at the provider's token endpoint (OpenID Connect Core 1.0, 3.1.3).
#pragma once

#include <atomic>
#include <boost/asio/thread_pool.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "services/gateway/directory_client.h"
#include "services/runtime/peer_shares.h"

namespace sixpoint::gateway {

enum class CodeEnd {
  kGiven,
  kCodeRefused,    // used, too old, or none of the provider's
  kClientRefused,  // the gateway is not let in: its settings are not the provider's
  kAway,           // no answer that can be read, in time
  kBusy,           // as many are under way as may, or were in the last 10 minutes
  kTicketUsed,     // the provider was asked by this ticket before
};

struct CodeAnswer {
  CodeEnd end = CodeEnd::kAway;
  std::string id_token;  // of kGiven; judged by nobody yet
  std::string why;       // for the log; nothing of it is the provider's own text
};

// Blocks for 10 s at most, and reads 64 KiB at most; follows no redirect and asks no proxy. Ends soon after `is_over` says so.
CodeAnswer ExchangeCode(const DirectoryClient& client, const std::string& code, const std::string& verifier,
                        const std::function<bool()>& is_over);

// The same for all connections of one client, as services/runtime/peer_address.h says. client_address: without a port.
std::string PeerOf(const std::string& client_address);

// Threads for what blocks: as many exchanges as these, and none that waits for its turn.
class CodeWorkers {
 public:
  // Of all, and of one client: who keeps his own busy leaves others theirs.
  static constexpr int kMost = 8, kMostOfPeer = kMost / 2;

  // Given back at its end.
  class Place {
   public:
    Place(CodeWorkers* workers, runtime::PeerShares::Share share) : workers_(*workers), share_(std::move(share)) {}
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    ~Place() { --workers_.running_; }

   private:
    CodeWorkers& workers_;
    const runtime::PeerShares::Share share_;
  };

  CodeWorkers() : pool_(kMost) {}
  // None: as many are under way as may, of all or of this client. From any thread.
  std::shared_ptr<Place> Take(const std::string& client_address);
  // The place is held until the job has ended.
  void Begin(std::shared_ptr<Place> place, std::function<void()> job);
  bool is_stopping() const { return is_stopping_; }
  // Nothing more is begun, and what is under way has ended when this returns.
  void Stop();

 private:
  std::atomic<int> running_{0};
  std::atomic<bool> is_stopping_{false};
  runtime::PeerShares shares_{kMostOfPeer};
  boost::asio::thread_pool pool_;
};

}  // namespace sixpoint::gateway
