// One call of a handler, as a client makes it.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"

namespace sixpoint::testing {

// Ends after 20 s.
template <typename Stub, typename Request, typename Response>
absl::StatusOr<Response> Call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                              const Request& request) {
  Response response;
  const grpc::Status status = (stub.*method)(runtime::ContextFor(20).get(), request, &response);
  if (!status.ok()) return runtime::FromGrpc(status);
  return response;
}

}  // namespace sixpoint::testing
