// Ends connections whose clients begin calls only to give them up: HTTP/2's rapid reset (CVE-2023-44487), which costs a client some
// bytes a call and gRPC 1.51 some 15 KB until a thread comes to it; while such a flood is read, none does.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <thread>

#include "services/runtime/connection_acceptor.h"

namespace sixpoint::runtime {

// One thread, which looks at what gRPC counts (channelz; GRPC_ARG_ENABLE_CHANNELZ has to be set). One server a process.
class FloodWatch {
 public:
  explicit FloodWatch(OpenConnections* connections);
  ~FloodWatch();
  FloodWatch(const FloodWatch&) = delete;
  FloodWatch& operator=(const FloodWatch&) = delete;

 private:
  void Run();
  void Look();

  OpenConnections* const connections_;

  std::int64_t calls_looked_at_ = 0;
  std::chrono::steady_clock::time_point counted_anew_;
  std::map<std::int64_t, std::int64_t> unanswered_before_;  // of each socket, when it was counted anew
  std::mutex mutex_;
  std::condition_variable stopping_;
  bool stopped_ = false;
  std::thread thread_;
};

}  // namespace sixpoint::runtime
