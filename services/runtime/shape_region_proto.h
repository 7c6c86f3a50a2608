// What becomes of each part of a surface where a blank does not contain the part: from rows to the contract.
#pragma once

#include "services/runtime/stored_enum.h"
#include "sixpoint/plant/v1/part.pb.h"
#include "storage/plant_registry.h"

namespace sixpoint::runtime {

// words: whose they are; they tell of a kind that this release does not know.
void ToProto(const storage::ShapeRegionRow& row, StoredWords* words, plant::v1::ShapeRegion* region);

}  // namespace sixpoint::runtime
