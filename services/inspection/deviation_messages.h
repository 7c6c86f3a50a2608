// Deviation maps from their rows.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>

#include "sixpoint/inspection/v1/deviation.pb.h"
#include "storage/deviations.h"

namespace sixpoint::inspection {

absl::StatusOr<v1::DeviationMap> ToProto(const storage::DeviationMapRow& row);
// Takes out what the BASIC view has not.
void LeaveBasic(v1::DeviationMap* map);
// Patches [first, first + count), as far as there are.
v1::DeviationPatches ToProto(const storage::DeviationPatchesRow& patches, std::size_t first, std::size_t count);
// What a recorded map was asked for.
v1::MapDeviationRequest RequestOf(const v1::DeviationMap& recorded);

}  // namespace sixpoint::inspection
