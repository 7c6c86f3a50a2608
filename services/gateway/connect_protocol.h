// The Connect protocol (https://connectrpc.com/docs/protocol) over HTTP/1.1, as texts and bytes: what of a request says which method is
// called and how, and how answers, failures and streams are written. Unary calls by POST and, where a method has no side effects, by GET;
// server streaming by POST. Nothing here calls anybody.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "services/gateway/exchange.h"

namespace sixpoint::gateway {

enum class Codec { kJson, kProto };

// What is called, and how its messages come and go.
struct ConnectCall {
  const google::protobuf::MethodDescriptor* method = nullptr;
  Codec codec = Codec::kJson;
  bool is_get = false;
  bool is_stream = false;
  std::optional<std::chrono::milliseconds> timeout;
  std::string message;  // of GET: as the query has it
};

// A refusal and the HTTP status that it is told by, which is its code's but where HTTP has words of its own.
struct ConnectRefusal {
  grpc::Status status;
  unsigned http_status = 0;  // 0: the code's
  std::string allow;         // of 405
};

// "/sixpoint.plant.v1.PlantService/GetBlade", of the contract alone; none of any other path.
const google::protobuf::MethodDescriptor* MethodOf(std::string_view path);

// UNIMPLEMENTED (404 of a method that is not known, 405, 415), INVALID_ARGUMENT (400).
std::optional<ConnectRefusal> ReadCall(const Exchange::Head& head, ConnectCall* call);

unsigned HttpStatusOf(grpc::StatusCode code);
// {"code": "not_found", "message": ..., "details": [{"type", "value", "debug"}]}
std::string ErrorJson(const grpc::Status& status);
HttpResponse ErrorResponse(const ConnectRefusal& refusal);
inline HttpResponse ErrorResponse(const grpc::Status& status) { return ErrorResponse(ConnectRefusal{status, 0, ""}); }

std::string ContentTypeOf(const ConnectCall& call);

// The message's bytes as gRPC has them. INVALID_ARGUMENT naming the field that is unknown or not of its type.
absl::StatusOr<std::string> BytesOfMessage(const google::protobuf::Descriptor& type, Codec codec, std::string text);
// INTERNAL of bytes that are no such message.
absl::StatusOr<std::string> MessageOfBytes(const google::protobuf::Descriptor& type, Codec codec, std::string bytes);

// One message of a stream, behind its five bytes; and what ends one.
std::string Enveloped(std::string_view message);
std::string EndOfStream(const grpc::Status& status, const HttpHeaders& trailing);
// The one message of a stream's request. INVALID_ARGUMENT of more, less, or a compressed one.
absl::StatusOr<std::string> OnlyEnvelope(std::string_view body);
inline constexpr std::size_t kEnvelope_bytes = 5;

}  // namespace sixpoint::gateway
