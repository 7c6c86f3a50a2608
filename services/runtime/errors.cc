#include "services/runtime/errors.h"

#include <absl/strings/cord.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "refusal/message_text.h"
#include "services/runtime/log.h"
#include "sixpoint/errors/v1/refusal.pb.h"
#include "storage/database.h"

namespace sixpoint::runtime {
namespace {

// What travels with an absl::Status inside a process, as plain text.
using storage::kReasonPayload;
constexpr char kMetadata[] = "sixpoint.metadata";
constexpr char kRetryDelay[] = "sixpoint.retry_delay_ms";
constexpr char kDomain[] = "sixpoint";
// Details travel in a header block that peers limit to 8 KiB, the message twice.
constexpr std::size_t kLongestMessage = 1500;
constexpr std::size_t kLongestViolations = 2500, kLongestName = 200;
constexpr int kRetryDelay_ms = 500;
constexpr int kLongestRetryDelay_ms = 60'000;

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
  return code == absl::StatusCode::kUnavailable || code == absl::StatusCode::kResourceExhausted ||
         code == absl::StatusCode::kAborted;
}

// Metadata stand in a status as they go over the wire.
void SetMetadata(const google::rpc::ErrorInfo& info, absl::Status* status) {
  google::rpc::ErrorInfo metadata;
  *metadata.mutable_metadata() = info.metadata();
  if (!metadata.metadata().empty()) status->SetPayload(kMetadata, absl::Cord(metadata.SerializeAsString()));
}

google::rpc::ErrorInfo InfoOf(const absl::Status& status) {
  google::rpc::ErrorInfo info;
  if (!info.ParseFromString(PayloadOf(status, kMetadata).value_or(""))) info.Clear();
  info.set_reason(PayloadOf(status, kReasonPayload).value_or(absl::StatusCodeToString(status.code())));
  info.set_domain(kDomain);
  return info;
}

google::rpc::PreconditionFailure PreconditionOf(const google::rpc::ErrorInfo& info, const std::string& message) {
  google::rpc::PreconditionFailure failure;
  auto* violation = failure.add_violations();
  violation->set_type(info.reason());
  const auto resource = info.metadata().find("resource");
  if (resource != info.metadata().end()) violation->set_subject(resource->second);
  violation->set_description(message);
  return failure;
}

// BadRequest for every client, and the parts of each violation for those that know ours. As many as fit.
void AddViolations(const std::vector<Violation>& violations, google::rpc::Status* details) {
  google::rpc::BadRequest bad_request;
  errors::v1::Refusal refusal;
  for (const Violation& violation : violations) {
    const std::size_t before = bad_request.ByteSizeLong() + refusal.ByteSizeLong();
    auto* told = bad_request.add_field_violations();
    told->set_field(violation.field);
    told->set_description(violation.field + ": " + violation.value + ", want " + violation.wanted);
    auto* parts = refusal.add_violations();
    parts->set_field(violation.field);
    parts->set_value(violation.value);
    parts->set_wanted(violation.wanted);
    if (before > 0 && bad_request.ByteSizeLong() + refusal.ByteSizeLong() > kLongestViolations) {
      bad_request.mutable_field_violations()->RemoveLast();
      refusal.mutable_violations()->RemoveLast();
      break;
    }
  }
  details->add_details()->PackFrom(bad_request);
  details->add_details()->PackFrom(refusal);
}

absl::Status RefusalOf(const errors::v1::Refusal& received) {
  std::vector<Violation> violations;
  for (const errors::v1::Violation& v : received.violations()) violations.push_back({v.field(), v.value(), v.wanted()});
  return Refuse(violations);
}

}  // namespace

absl::Status Failure(ErrorReason reason, const std::string& message, const Metadata& metadata) {
  absl::Status failure(CodeOf(reason), message);
  failure.SetPayload(kReasonPayload, absl::Cord(errors::v1::ErrorReason_Name(reason)));
  google::rpc::ErrorInfo info;
  for (const auto& [key, value] : metadata) (*info.mutable_metadata())[key] = Tame(value, kLongestName);
  SetMetadata(info, &failure);
  return failure;
}

absl::StatusCode CodeOf(ErrorReason reason) {
  const auto* value = errors::v1::ErrorReason_descriptor()->FindValueByNumber(reason);
  if (value == nullptr || !value->options().HasExtension(errors::v1::code)) return absl::StatusCode::kUnknown;
  return static_cast<absl::StatusCode>(value->options().GetExtension(errors::v1::code));  // both are google.rpc.Code
}

absl::Status NotKnown(const std::string& field, const std::string& name, const absl::Status& status) {
  return absl::IsNotFound(status) ? Refuse(field, name, "one that the plant knows") : status;
}

absl::Status ReceivedFailure(absl::StatusCode code, const std::string& reason, const std::string& message) {
  absl::Status failure(code, message);
  if (!reason.empty()) failure.SetPayload(kReasonPayload, absl::Cord(reason));
  return failure;
}

bool HasReason(const absl::Status& status, ErrorReason reason) {
  return ReasonOf(status) == errors::v1::ErrorReason_Name(reason);
}

Metadata MetadataOf(const absl::Status& status) {
  const google::rpc::ErrorInfo info = InfoOf(status);
  return {info.metadata().begin(), info.metadata().end()};
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
  const google::rpc::ErrorInfo info = InfoOf(status);
  details.add_details()->PackFrom(info);
  if (absl::IsFailedPrecondition(status)) details.add_details()->PackFrom(PreconditionOf(info, message));
  if (const std::vector<Violation> violations = ViolationsOf(status); !violations.empty()) {
    AddViolations(violations, &details);
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
    errors::v1::Refusal refusal;
    google::rpc::RetryInfo retry;
    if (detail.UnpackTo(&info)) {
      // The code's own name stands where no reason was given.
      if (info.reason() != absl::StatusCodeToString(received.code())) {
        received.SetPayload(kReasonPayload, absl::Cord(info.reason()));
      }
      SetMetadata(info, &received);
    } else if (detail.UnpackTo(&refusal) && refusal.violations_size() > 0 && absl::IsInvalidArgument(received)) {
      const std::string reason = ReasonOf(received);
      received = RefusalOf(refusal);
      if (!reason.empty()) received.SetPayload(kReasonPayload, absl::Cord(reason));
    } else if (detail.UnpackTo(&retry)) {
      const std::int64_t seconds = std::clamp<std::int64_t>(retry.retry_delay().seconds(), 0, 3600);
      received.SetPayload(kRetryDelay,
                          absl::Cord(std::to_string(1000 * seconds + retry.retry_delay().nanos() / 1'000'000)));
    }
  }
  return received;
}

}  // namespace sixpoint::runtime
