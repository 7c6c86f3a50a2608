// A computed deviation map as it is kept.
#pragma once

#include "services/inspection/map_deviation.h"
#include "services/runtime/recorded_call.h"
#include "storage/deviations.h"

namespace sixpoint::inspection {

runtime::Made<storage::DeviationMapRow> RecordOf(const RegisteredBlade& blade, const DeviationOrder& order,
                                                 MappedDeviation mapped);

}  // namespace sixpoint::inspection
