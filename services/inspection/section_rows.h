// A computed section measurement as it is kept.
#pragma once

#include <vector>

#include "services/inspection/measure_sections.h"
#include "services/runtime/recorded_call.h"
#include "storage/sections.h"

namespace sixpoint::inspection {

runtime::Made<storage::SectionMeasurementRow> RecordOf(const clients::RegisteredBlade& blade, const SectionOrder& order,
                                                       const std::vector<SectionFinding>& findings);

}  // namespace sixpoint::inspection
