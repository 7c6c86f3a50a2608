#include "services/correction/pose_failure.h"

#include "services/runtime/errors.h"

namespace sixpoint::correction {

absl::Status PoseFailure(const absl::Status& status, const std::string& registration, const std::string& group) {
  const runtime::Metadata about = {{"resource", registration}, {"group", group}};
  const std::string message(status.message());
  if (absl::IsFailedPrecondition(status)) return runtime::Failure(errors::v1::POSE_SINGULAR, message, about);
  if (absl::IsOutOfRange(status)) return runtime::Failure(errors::v1::POSE_OUT_OF_LIMITS, message, about);
  return status;
}

}  // namespace sixpoint::correction
