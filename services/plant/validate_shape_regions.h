// Checks of a part's shape regions by themselves: whether they overlap only its surface tells.
#pragma once

#include <absl/status/status.h>

#include <vector>

#include "sixpoint/plant/v1/part.pb.h"
#include "storage/plant_registry.h"

namespace sixpoint::plant {

absl::Status ReadShapeRegions(const v1::Part& part, std::vector<storage::ShapeRegionRow>* rows);

}  // namespace sixpoint::plant
