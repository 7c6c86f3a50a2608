// What AssessEfficacy refuses.
#pragma once

#include <absl/status/status.h>

#include <vector>

#include "metrology/efficacy/efficacy.h"

namespace sixpoint::metrology {

absl::Status CheckOutcomes(const std::vector<BladeOutcome>& blades, const EfficacyOptions& options);

}  // namespace sixpoint::metrology
