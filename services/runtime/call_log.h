// One log line for each call, its span (span.h); what was refused for who asked is counted (denials.h).
// Private to runtime.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "services/runtime/call_scope.h"
#include "services/runtime/denials.h"

namespace sixpoint::runtime {

// The handler finds the traceparent of the call's own span in its metadata, of the trace that the caller named, or of a new one.
class CallLogFactory : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  // Lives longer.
  explicit CallLogFactory(Denials* denials) : denials_(denials) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override;

 private:
  Denials* const denials_;
};

// What the log says of a call that runs; none where nothing is logged of it.
std::shared_ptr<CallFacts> FactsOf(const grpc::ServerContextBase& context);

// Calls of our own services that have begun and not ended.
int CallsInFlight();

}  // namespace sixpoint::runtime
