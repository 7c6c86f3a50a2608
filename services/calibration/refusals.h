// What kernels refuse, as the wire wants it.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "services/runtime/errors.h"

namespace sixpoint::calibration {

// A kernel's FAILED_PRECONDITION says that the data do not determine what was asked for.
inline absl::Status WithReason(const absl::Status& status,
                               runtime::ErrorReason undetermined = errors::v1::CALIBRATION_UNDETERMINED) {
  return absl::IsFailedPrecondition(status) ? runtime::Failure(undetermined, std::string(status.message())) : status;
}

}  // namespace sixpoint::calibration
