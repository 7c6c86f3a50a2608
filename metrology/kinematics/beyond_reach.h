// What a machine cannot do, as a status.
#pragma once

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "refusal/refusal.h"

namespace sixpoint::metrology {

// OUT_OF_RANGE "field: value, want wanted", with the violations as data (ViolationsOf): what is asked for is well formed, and out of reach.
absl::Status BeyondReach(const std::vector<Violation>& violations);
// The same with `prefix` before each of its fields; what is beyond reach stays so, where Under (refusal.h) makes it INVALID_ARGUMENT.
absl::Status UnderField(const std::string& prefix, const absl::Status& refusal);

}  // namespace sixpoint::metrology
