// Which findings of a blank a rigid motion of the part can cure: pure.
#pragma once

#include <absl/status/status.h>

#include <functional>

#include "services/inspection/assess.h"

namespace sixpoint::inspection {

// Sets `cure` of each finding that is out, and the conflicts of profiles that no motion cures. Profiles of one datum system are cured by one
// motion or not at all.
absl::Status FindCures(const AssessmentInputs& inputs, const std::function<bool()>& keep_going, Assessed* assessed);

}  // namespace sixpoint::inspection
