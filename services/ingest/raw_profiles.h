// ENCODING_RAW_PROFILES: profiles as the sensor gives them (the layout stands in ingest.proto).
#pragma once

#include <absl/status/statusor.h>

#include <string_view>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::ingest {

struct RawProfiles {
  metrology::Points points_mm;  // sensor frame, valid columns only
  std::vector<int> columns;     // of each point
};

// INVALID_ARGUMENT with what is wrong: a payload that ends inside a profile, bits beyond the columns, an encoder reading
// that is not finite, more or fewer points than `point_count`. Memory is bounded by point_count.
absl::StatusOr<RawProfiles> ParseRawProfiles(std::string_view payload, int columns_per_profile, double raw_step_mm,
                                             int point_count);

}  // namespace sixpoint::ingest
