// How many calls a server answers at once. More are refused before anything is read of them, and a connection that keeps a
// server at refusing is read again only when there is room: a refusal costs gRPC a third of what a small read costs, and 10 times as
// many calls as can be answered would leave time for refusals alone. Private to runtime; admission asks, once it knows who calls: a
// certificate that nobody gave would be another caller each time.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "services/runtime/compute_pool.h"
#include "services/runtime/connection_acceptor.h"

namespace sixpoint::runtime {

struct CallLimits {
  int at_once = kAllLetIn;
  // One identity, over the gateway one person: two together may take all places, one never.
  int per_caller = 48;
  int of_nobody = 8;  // of all together who call what anybody may, without a certificate
  // Of one connection (HTTP/2's MAX_CONCURRENT_STREAMS). More wait in their client, where they cost nothing; what one connection brings
  // at one go is soon answered, or refused.
  int per_connection = 16;
};

// Thread-safe; outlives its places. One thread, which reads paused connections again.
class CallGate {
 public:
  // connections: lives longer.
  CallGate(CallLimits limits, OpenConnections* connections);
  ~CallGate();
  CallGate(const CallGate&) = delete;
  CallGate& operator=(const CallGate&) = delete;

  // Given back at its end.
  class Place {
   public:
    Place(CallGate* gate, std::string caller) : gate_(gate), caller_(std::move(caller)) {}
    Place(Place&& other) noexcept : gate_(std::exchange(other.gate_, nullptr)), caller_(std::move(other.caller_)) {}
    Place& operator=(Place&&) = delete;
    ~Place() {
      if (gate_ != nullptr) gate_->Leave(caller_);
    }

   private:
    CallGate* gate_;
    std::string caller_;
  };
  // caller: an identity's text; empty: nobody's. None: the call is to be answered with Refusal().
  std::optional<Place> Enter(std::string caller, const grpc::ServerContextBase& context);
  // A call was refused for who asked: it costs as much.
  void Refused(const grpc::ServerContextBase& context);
  // RESOURCE_EXHAUSTED, and when to come again.
  static const grpc::Status& Refusal();

 private:
  using Clock = std::chrono::steady_clock;
  struct Paused {
    std::string peer, caller;  // the connection as gRPC names it, and whose it is: no room is kept for nobody
    Clock::time_point since;
  };
  // Of a connection that is read again: room was waited for, and nobody who comes meanwhile takes it. gRPC reads at one go all that it
  // waited with, so all of it is taken: what waited is answered, not refused after all.
  struct Turn {
    std::string caller;
    int calls_left;
    Clock::time_point until;
  };

  void Leave(const std::string& caller);
  bool MayRefuse();
  void Run();
  void ReadAgain();
  void Pause(std::string peer, const std::string& caller);
  int ReservedOf(const std::string& caller) const;
  bool HasATurnFor(const Paused& one) const;

  const CallLimits limits_;
  OpenConnections* const connections_;
  std::mutex mutex_;
  std::map<std::string, int> of_caller_;
  int in_all_ = 0;
  double refusals_left_;
  Clock::time_point refusals_counted_ = Clock::now();
  std::list<Paused> paused_;  // who waits longest first
  std::map<std::string, Turn> turns_;
  Clock::time_point read_for_refusal_;
  std::condition_variable changed_;
  bool stopped_ = false;
  std::thread thread_;
};

}  // namespace sixpoint::runtime
