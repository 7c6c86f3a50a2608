// What becomes of each part of a surface where a blank does not contain the part: from rows to the contract.
#pragma once

#include "sixpoint/plant/v1/part.pb.h"
#include "storage/plant_registry.h"

namespace sixpoint::runtime {

// A kind that this release does not know is unspecified.
void ToProto(const storage::ShapeRegionRow& row, plant::v1::ShapeRegion* region);

}  // namespace sixpoint::runtime
