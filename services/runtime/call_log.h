// One log line for each call: rpc, code, duration and trace id. Private to runtime.
#pragma once

#include <grpcpp/support/server_interceptor.h>

namespace sixpoint::runtime {

// Also gives a call without a well-formed traceparent a new one, which the handler then finds in its metadata.
class CallLogFactory : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override;
};

// Calls of our own services that have begun and not ended.
int CallsInFlight();

}  // namespace sixpoint::runtime
