#include "services/runtime/errors.h"

#include <absl/strings/cord.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "services/runtime/log.h"
#include "storage/database.h"

namespace sixpoint::runtime {
namespace {

// What travels with an absl::Status inside a process, as plain text.
using storage::kReasonPayload;
constexpr char kField[] = "sixpoint.field";
constexpr char kRetryDelay[] = "sixpoint.retry_delay_ms";
constexpr char kDomain[] = "sixpoint";
// Details travel in a header block that peers limit to 8 KiB, the message twice.
constexpr size_t kLongestMessage = 1500;
constexpr size_t kLongestValue = 120;
constexpr int kRetryDelay_ms = 500;
constexpr int kLongestRetryDelay_ms = 60'000;

// Text that came from outside: cut, and without control characters or broken UTF-8 at the cut.
std::string Tame(std::string text, size_t longest) {
  if (text.size() > longest) {
    while (longest > 0 && (static_cast<unsigned char>(text[longest]) & 0xc0) == 0x80) --longest;
    text = text.substr(0, longest) + "...";
  }
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return text;
}

std::optional<std::string> PayloadOf(const absl::Status& status, const char* url) {
  const auto payload = status.GetPayload(url);
  if (!payload.has_value()) return std::nullopt;
  return std::string(*payload);
}

// Exhaustive by its lack of a default.
grpc::StatusCode GrpcCodeOf(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kOk:
      return grpc::StatusCode::OK;
    case absl::StatusCode::kCancelled:
      return grpc::StatusCode::CANCELLED;
    case absl::StatusCode::kUnknown:
      return grpc::StatusCode::UNKNOWN;
    case absl::StatusCode::kInvalidArgument:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case absl::StatusCode::kDeadlineExceeded:
      return grpc::StatusCode::DEADLINE_EXCEEDED;
    case absl::StatusCode::kNotFound:
      return grpc::StatusCode::NOT_FOUND;
    case absl::StatusCode::kAlreadyExists:
      return grpc::StatusCode::ALREADY_EXISTS;
    case absl::StatusCode::kPermissionDenied:
      return grpc::StatusCode::PERMISSION_DENIED;
    case absl::StatusCode::kResourceExhausted:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case absl::StatusCode::kFailedPrecondition:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case absl::StatusCode::kAborted:
      return grpc::StatusCode::ABORTED;
    case absl::StatusCode::kOutOfRange:
      return grpc::StatusCode::OUT_OF_RANGE;
    case absl::StatusCode::kUnimplemented:
      return grpc::StatusCode::UNIMPLEMENTED;
    case absl::StatusCode::kInternal:
      return grpc::StatusCode::INTERNAL;
    case absl::StatusCode::kUnavailable:
      return grpc::StatusCode::UNAVAILABLE;
    case absl::StatusCode::kDataLoss:
      return grpc::StatusCode::DATA_LOSS;
    case absl::StatusCode::kUnauthenticated:
      return grpc::StatusCode::UNAUTHENTICATED;
    case absl::StatusCode::kDoNotUseReservedForFutureExpansionUseDefaultInSwitchInstead_:
      break;
  }
  return grpc::StatusCode::UNKNOWN;
}

// A peer may send any number.
absl::StatusCode AbslCodeOf(grpc::StatusCode code) {
  const int number = static_cast<int>(code);
  if (number < 0 || number > 16) return absl::StatusCode::kUnknown;
  return static_cast<absl::StatusCode>(number);  // both are google.rpc.Code
}

bool MayBeRetried(absl::StatusCode code) {
  return code == absl::StatusCode::kUnavailable || code == absl::StatusCode::kResourceExhausted;
}

std::string TextOf(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  char buffer[32];
  return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

}  // namespace

absl::Status Refuse(const std::string& field, const std::string& value, const std::string& wanted) {
  const std::string shown = value.empty() ? "empty" : Tame(value, kLongestValue);
  absl::Status refusal = absl::InvalidArgumentError(field + ": " + shown + ", want " + wanted);
  refusal.SetPayload(kField, absl::Cord(field));
  return refusal;
}

absl::Status Refuse(const std::string& field, double value, const std::string& wanted) {
  return Refuse(field, TextOf(value), wanted);
}

absl::Status Failure(absl::StatusCode code, const std::string& reason, const std::string& message) {
  absl::Status failure(code, message);
  failure.SetPayload(kReasonPayload, absl::Cord(reason));
  return failure;
}

absl::Status AsRefusal(const absl::Status& status) {
  const std::string message(status.message());
  const std::size_t colon = message.find(": "), want = message.rfind(", want ");
  if (!absl::IsInvalidArgument(status) || colon == std::string::npos || want == std::string::npos || want < colon)
    return status;
  return Refuse(message.substr(0, colon), message.substr(colon + 2, want - colon - 2), message.substr(want + 7));
}

absl::Status NotKnown(const std::string& field, const std::string& name, const absl::Status& status) {
  return absl::IsNotFound(status) ? Refuse(field, name, "one that the plant knows") : status;
}

std::string ReasonOf(const absl::Status& status) { return PayloadOf(status, kReasonPayload).value_or(""); }

std::chrono::milliseconds RetryDelayOf(const absl::Status& status) {
  const std::string text = PayloadOf(status, kRetryDelay).value_or("0");
  int delay_ms = 0;
  std::from_chars(text.data(), text.data() + text.size(), delay_ms);
  return std::chrono::milliseconds(std::clamp(delay_ms, 0, kLongestRetryDelay_ms));
}

grpc::Status ToGrpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  std::string message = Tame(std::string(status.message()), kLongestMessage);
  if (status.code() == absl::StatusCode::kInternal) {
    const std::string reference = storage::NewUuid();
    Log(LogLevel::kError, message, {{"code", std::string("INTERNAL")}, {"reference", reference}});
    message = "internal error; the server's log says more under reference " + reference;
  }
  google::rpc::Status details;
  details.set_code(static_cast<int>(GrpcCodeOf(status.code())));
  details.set_message(message);
  google::rpc::ErrorInfo info;
  info.set_reason(PayloadOf(status, kReasonPayload).value_or(absl::StatusCodeToString(status.code())));
  info.set_domain(kDomain);
  details.add_details()->PackFrom(info);
  if (const std::optional<std::string> field = PayloadOf(status, kField)) {
    google::rpc::BadRequest bad_request;
    auto* violation = bad_request.add_field_violations();
    violation->set_field(*field);
    violation->set_description(message);
    details.add_details()->PackFrom(bad_request);
  }
  if (MayBeRetried(status.code())) {
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_nanos(kRetryDelay_ms * 1'000'000);
    details.add_details()->PackFrom(retry);
  }
  return grpc::Status(GrpcCodeOf(status.code()), message, details.SerializeAsString());
}

absl::Status FromGrpc(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  absl::Status received(AbslCodeOf(status.error_code()), status.error_message());
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) return received;
  for (const google::protobuf::Any& detail : details.details()) {
    google::rpc::ErrorInfo info;
    google::rpc::BadRequest bad_request;
    google::rpc::RetryInfo retry;
    if (detail.UnpackTo(&info)) {
      // The code's own name stands where no reason was given.
      if (info.reason() != absl::StatusCodeToString(received.code())) {
        received.SetPayload(kReasonPayload, absl::Cord(info.reason()));
      }
    } else if (detail.UnpackTo(&bad_request) && bad_request.field_violations_size() > 0) {
      received.SetPayload(kField, absl::Cord(bad_request.field_violations(0).field()));
    } else if (detail.UnpackTo(&retry)) {
      const std::int64_t seconds = std::clamp<std::int64_t>(retry.retry_delay().seconds(), 0, 3600);
      received.SetPayload(kRetryDelay,
                          absl::Cord(std::to_string(1000 * seconds + retry.retry_delay().nanos() / 1'000'000)));
    }
  }
  return received;
}

}  // namespace sixpoint::runtime
