// Refusals and their one way to the wire.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <map>
#include <string>
#include <utility>

#include "refusal/refusal.h"
#include "sixpoint/errors/v1/error_reason.pb.h"

namespace sixpoint::runtime {

// "scan.profile_pitch_mm: -0.025, want > 0": what every layer refuses with.
using sixpoint::Refusals;
using sixpoint::Refuse;

using errors::v1::ErrorReason;
// ErrorInfo.metadata: "resource" names what the failure is about, other keys as the reason's comment in the contract says.
using Metadata = std::map<std::string, std::string>;

// What a request names and is not there is the request's fault; other failures stay what they are.
absl::Status NotKnown(const std::string& field, const std::string& name, const absl::Status& status);
// Any other failure that a client may want to tell from its like: the reason (docs/errors.md) has its code.
absl::Status Failure(ErrorReason reason, const std::string& message, const Metadata& metadata = {});
// The contract says it of each reason.
absl::StatusCode CodeOf(ErrorReason reason);
// As another process told it, in a message: its reason may be newer than this program.
absl::Status ReceivedFailure(absl::StatusCode code, const std::string& reason, const std::string& message);

// The one exhaustive map: code by code, with a serialised google.rpc.Status in the details: ErrorInfo; BadRequest and Refusal
// with all violations of INVALID_ARGUMENT; PreconditionFailure for FAILED_PRECONDITION; RetryInfo for UNAVAILABLE,
// RESOURCE_EXHAUSTED and ABORTED. INTERNAL hides its message from the client and logs it.
grpc::Status ToGrpc(const absl::Status& status);
// A handler's end: the answer into its response, or why there is none.
template <typename Message>
grpc::Status Answer(absl::StatusOr<Message> answer, Message* response) {
  if (answer.ok()) *response = *std::move(answer);
  return ToGrpc(answer.status());
}
// Back again, on the client side of a call between services: keeps code, message, reason, metadata, violations and
// RetryInfo.
absl::Status FromGrpc(const grpc::Status& status);
// ErrorInfo.reason of a status made here or received; empty when it has none.
std::string ReasonOf(const absl::Status& status);
bool HasReason(const absl::Status& status, ErrorReason reason);
Metadata MetadataOf(const absl::Status& status);
// RetryInfo.retry_delay of a status received, at most a minute; 0 where it has none.
std::chrono::milliseconds RetryDelayOf(const absl::Status& status);

}  // namespace sixpoint::runtime
