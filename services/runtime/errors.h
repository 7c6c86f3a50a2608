// Refusals and their one way to the wire.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <string>
#include <utility>

namespace sixpoint::runtime {

// "scan.profile_pitch_mm: -0.025, want > 0" as INVALID_ARGUMENT with a BadRequest field violation.
absl::Status Refuse(const std::string& field, const std::string& value, const std::string& wanted);
absl::Status Refuse(const std::string& field, double value, const std::string& wanted);

// Other codes with a machine-readable reason (UPPER_SNAKE, ErrorInfo.reason; domain "sixpoint").
absl::Status Failure(absl::StatusCode code, const std::string& reason, const std::string& message);

// A kernel's refusal, whose message names field, value and wanted, as Refuse makes it.
absl::Status AsRefusal(const absl::Status& status);
// What a request names and is not there is the request's fault; other failures stay what they are.
absl::Status NotKnown(const std::string& field, const std::string& name, const absl::Status& status);

// The one exhaustive map: code by code, with a serialised google.rpc.Status (BadRequest, ErrorInfo, and RetryInfo for
// UNAVAILABLE and RESOURCE_EXHAUSTED) in the details. INTERNAL hides its message from the client and logs it.
grpc::Status ToGrpc(const absl::Status& status);
// A handler's end: the answer into its response, or why there is none.
template <typename Message>
grpc::Status Answer(absl::StatusOr<Message> answer, Message* response) {
  if (answer.ok()) *response = *std::move(answer);
  return ToGrpc(answer.status());
}
// Back again, on the client side of a call between services: keeps code, message, reason and RetryInfo.
absl::Status FromGrpc(const grpc::Status& status);
// ErrorInfo.reason of a status made here or received; empty when it has none.
std::string ReasonOf(const absl::Status& status);
// RetryInfo.retry_delay of a status received, at most a minute; 0 where it has none.
std::chrono::milliseconds RetryDelayOf(const absl::Status& status);

}  // namespace sixpoint::runtime
