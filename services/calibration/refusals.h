// What kernels and other services refuse, as the wire wants it.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "services/runtime/errors.h"

namespace sixpoint::calibration {

// The kernel names field, value and wanted in its message; the wire wants the field apart.
inline absl::Status AsRefusal(const absl::Status& status,
                              const std::string& undetermined = "CALIBRATION_UNDETERMINED") {
  const std::string message(status.message());
  if (absl::IsFailedPrecondition(status)) return runtime::Failure(status.code(), undetermined, message);
  const std::size_t colon = message.find(": "), want = message.rfind(", want ");
  if (!absl::IsInvalidArgument(status) || colon == std::string::npos || want == std::string::npos || want < colon)
    return status;
  return runtime::Refuse(message.substr(0, colon), message.substr(colon + 2, want - colon - 2),
                         message.substr(want + 7));
}

// What was asked for and is not there is the request's fault.
inline absl::Status NotKnown(const std::string& field, const std::string& name, const absl::Status& status) {
  return absl::IsNotFound(status) ? runtime::Refuse(field, name, "one that the plant knows") : status;
}

}  // namespace sixpoint::calibration
