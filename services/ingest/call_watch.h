// Ends a streaming call whose time is over while its handler waits for a client that sends nothing.
#pragma once

#include <grpcpp/alarm.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>

namespace sixpoint::ingest {

// Lives inside the handler.
class CallWatch {
 public:
  CallWatch(grpc::ServerContext* context, std::chrono::system_clock::time_point deadline);
  ~CallWatch();
  CallWatch(const CallWatch&) = delete;
  CallWatch& operator=(const CallWatch&) = delete;

 private:
  struct Watched;
  std::shared_ptr<Watched> watched_;
  grpc::Alarm alarm_;
};

}  // namespace sixpoint::ingest
