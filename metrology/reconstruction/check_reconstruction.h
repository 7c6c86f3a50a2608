// What ReconstructShape refuses before it begins. Used by it alone.
#pragma once

#include <absl/status/status.h>

#include "metrology/reconstruction/reconstruct_shape.h"

namespace sixpoint::metrology {

absl::Status CheckOptions(const ReconstructionOptions& options);
absl::Status CheckBlank(const std::vector<BlankPatch>& blank);

}  // namespace sixpoint::metrology
