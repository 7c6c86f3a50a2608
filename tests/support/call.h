// One call of a handler, as a client makes it.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <utility>
#include <vector>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::testing {

// Ends after 20 s, later under a sanitizer.
template <typename Stub, typename Request, typename Response>
absl::StatusOr<Response> Call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                              const Request& request) {
  Response response;
  const grpc::Status status = (stub.*method)(runtime::ContextFor(kPatience * 20).get(), request, &response);
  if (!status.ok()) return runtime::FromGrpc(status);
  return response;
}

// What a handler streamed, and how it ended.
template <typename Message>
struct Streamed {
  std::vector<Message> messages;
  absl::Status status;
};
template <typename Stub, typename Request, typename Message>
Streamed<Message> CallStream(Stub& stub,
                             std::unique_ptr<grpc::ClientReader<Message>> (Stub::*method)(grpc::ClientContext*,
                                                                                          const Request&),
                             const Request& request) {
  Streamed<Message> streamed;
  const auto context = runtime::ContextFor(kPatience * 20);
  const auto reader = (stub.*method)(context.get(), request);
  for (Message message; reader->Read(&message);) streamed.messages.push_back(std::move(message));
  streamed.status = runtime::FromGrpc(reader->Finish());
  return streamed;
}

}  // namespace sixpoint::testing
