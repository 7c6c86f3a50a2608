// What kernels refuse, as the wire wants it.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "services/runtime/errors.h"

namespace sixpoint::calibration {

// undetermined: the reason of what the points do not determine.
inline absl::Status AsRefusal(const absl::Status& status,
                              const std::string& undetermined = "CALIBRATION_UNDETERMINED") {
  if (absl::IsFailedPrecondition(status))
    return runtime::Failure(status.code(), undetermined, std::string(status.message()));
  return runtime::AsRefusal(status);
}

}  // namespace sixpoint::calibration
