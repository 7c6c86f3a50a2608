// A computed deviation map as it is kept.
#pragma once

#include "services/inspection/map_deviation.h"
#include "services/runtime/recorded_call.h"
#include "storage/deviations.h"

namespace sixpoint::inspection {

runtime::Made<storage::DeviationMapRow> RecordOf(const clients::RegisteredBlade& blade, const DeviationOrder& order,
                                                 MappedDeviation mapped);
// Of a region as it is kept, what it was ordered with.
metrology::SurfaceRegion BoundsOf(const storage::DeviationRegionRow& row);

}  // namespace sixpoint::inspection
