// Ends a call whose client does not take what it is sent: its handler waits with a thread, and with all that it holds.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <chrono>

#include "services/runtime/call_watch.h"

namespace sixpoint::runtime {

class WriteWatchFactory : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  // For one message, beside what a slow line may take for its bytes.
  explicit WriteWatchFactory(std::chrono::milliseconds patience) : patience_(patience) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override;

 private:
  const std::chrono::milliseconds patience_;
  CallWatchdog watchdog_;
};

}  // namespace sixpoint::runtime
