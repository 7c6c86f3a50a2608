// Ends streaming calls whose time is over, or whose other side neither sends nor reads, while their handlers wait.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <list>
#include <mutex>
#include <thread>

namespace sixpoint::runtime {

// One thread for all calls of a service. Thread-safe; outlives its watches.
class CallWatchdog {
 public:
  CallWatchdog();
  ~CallWatchdog();
  CallWatchdog(const CallWatchdog&) = delete;
  CallWatchdog& operator=(const CallWatchdog&) = delete;

 private:
  friend class CallWatch;
  using Clock = std::chrono::steady_clock;
  struct Watched {
    grpc::ServerContextBase* context;
    Clock::time_point deadline;
    Clock::duration patience;
    std::atomic<Clock::rep> touched;
  };
  void Watch();

  std::mutex mutex_;
  std::condition_variable stopping_;
  bool stopped_ = false;
  std::list<Watched> watched_;
  std::thread thread_;
};

// Lives inside the handler; cancels its call at the deadline, or when it was not touched for `patience`.
class CallWatch {
 public:
  CallWatch(CallWatchdog* watchdog, grpc::ServerContextBase* context, std::chrono::steady_clock::time_point deadline,
            std::chrono::milliseconds patience);
  ~CallWatch();
  CallWatch(const CallWatch&) = delete;
  CallWatch& operator=(const CallWatch&) = delete;

  // A message came or went.
  void Touch();

 private:
  CallWatchdog* const watchdog_;
  std::list<CallWatchdog::Watched>::iterator watched_;
};

}  // namespace sixpoint::runtime
