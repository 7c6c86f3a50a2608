// One log line for each call: rpc, who called, code, duration and trace id; what was refused for who asked is counted (denials.h).
// Private to runtime.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include "services/runtime/denials.h"

namespace sixpoint::runtime {

// Also gives a call without a well-formed traceparent a new one, which the handler then finds in its metadata.
class CallLogFactory : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  // Lives longer.
  explicit CallLogFactory(Denials* denials) : denials_(denials) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override;

 private:
  Denials* const denials_;
};

// Calls of our own services that have begun and not ended.
int CallsInFlight();

}  // namespace sixpoint::runtime
