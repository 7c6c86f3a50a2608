// Refusals and their one way to the wire.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <string>

#include "refusal/refusal.h"

namespace sixpoint::runtime {

// "scan.profile_pitch_mm: -0.025, want > 0": what every layer refuses with.
using sixpoint::Refusals;
using sixpoint::Refuse;

// Other codes with a machine-readable reason (UPPER_SNAKE, ErrorInfo.reason; domain "sixpoint").
absl::Status Failure(absl::StatusCode code, const std::string& reason, const std::string& message);

// The one exhaustive map: code by code, with a serialised google.rpc.Status (ErrorInfo, BadRequest and Refusal, RetryInfo for
// UNAVAILABLE and RESOURCE_EXHAUSTED) in the details. INTERNAL hides its message from the client and logs it.
grpc::Status ToGrpc(const absl::Status& status);
// Back again, on the client side of a call between services: keeps code, message, reason, violations and RetryInfo.
absl::Status FromGrpc(const grpc::Status& status);
// ErrorInfo.reason of a status made here or received; empty when it has none.
std::string ReasonOf(const absl::Status& status);
// RetryInfo.retry_delay of a status received, at most a minute; 0 where it has none.
std::chrono::milliseconds RetryDelayOf(const absl::Status& status);

}  // namespace sixpoint::runtime
