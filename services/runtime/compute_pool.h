// Bounds what runs at once in a server, and how many wait for it: first come, first served. What holds no slot holds no
// memory but its request. The one bound of its kind: with nobody waiting it refuses at once, with patient callers it is a
// queue for cores or workers.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <utility>

#include "services/runtime/errors.h"
#include "services/runtime/metrics.h"

namespace sixpoint::runtime {

struct PoolLimits {
  int at_once = 4;
  int waiting = 32;  // more are refused at once; 0: nobody waits
};

// As many as the call gate lets in: they wait, and it is the gate that refuses. A pool's refusal comes after the questions of who may,
// which cost nearly what a small call costs.
inline constexpr int kAllLetIn = 96;

// Thread-safe; outlives its slots.
class ComputePool {
 public:
  // what: registrations, ... and the reason of a refusal, REGISTRATIONS_FULL, ...
  ComputePool(PoolLimits limits, std::string what, ErrorReason reason);

  // Free again at its end.
  class Slot {
   public:
    explicit Slot(ComputePool* pool) : pool_(pool) {}
    Slot(Slot&& other) noexcept : pool_(std::exchange(other.pool_, nullptr)), begin_(other.begin_) {}
    Slot& operator=(Slot&&) = delete;
    ~Slot() {
      if (pool_ != nullptr) pool_->Leave(begin_);
    }

   private:
    ComputePool* pool_;
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  };

  enum class Patience {
    // RESOURCE_EXHAUSTED where as many wait as may, or where those before it would, by what was seen, leave it no time: who
    // cannot end before its deadline would only take the time of those who can.
    kBounded,
    kPatient,  // waits beyond that bound: for callers whose number their service bounds by itself
  };
  // The caller's turn, waited for. DEADLINE_EXCEEDED at the deadline, CANCELLED within some hundredths of a second after
  // keep_going says so.
  absl::StatusOr<Slot> Enter(std::chrono::steady_clock::time_point deadline, const std::function<bool()>& keep_going,
                             Patience patience = Patience::kBounded);

  struct Use {
    int running = 0;
    int waiting = 0;
  };
  Use use() const;

 private:
  void Leave(std::chrono::steady_clock::time_point begin);

  const PoolLimits limits_;
  const std::string what_;
  const ErrorReason reason_;
  Gauge running_gauge_, waiting_gauge_;
  Histogram wait_s_;
  Counter refused_;
  mutable std::mutex mutex_;
  // Each is woken when it may be its turn, and no other.
  struct Waiting {
    std::condition_variable turn;
  };
  void WakeFirst();
  std::list<Waiting> waiting_;  // first come, first in the list
  int bounded_count_ = 0;       // of those waiting
  int running_ = 0;
  std::chrono::steady_clock::duration usual_{};  // of a slot held, the latest counting most; 0: none was yet
};

}  // namespace sixpoint::runtime
