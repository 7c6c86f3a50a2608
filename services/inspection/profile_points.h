// A profile tolerance's patches as points with their deviations, for files of other systems.
#pragma once

#include <vector>

#include "exchange/inspected_part.h"
#include "storage/deviations.h"

namespace sixpoint::inspection {

// Of the profile's region, those that were seen: the deviation in its zone, mm, and so with the motion taken off that a zone of form has.
// DATA_LOSS where the patches are not the map's.
absl::StatusOr<std::vector<exchange::DeviationPoint>> ProfilePoints(const storage::DeviationMapRow& map,
                                                                    const storage::DeviationProfileRow& profile,
                                                                    const storage::DeviationPatchesRow& patches);

}  // namespace sixpoint::inspection
