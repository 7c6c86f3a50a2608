// A reconstruction as it is kept.
#pragma once

#include "services/correction/reconstruct.h"
#include "services/runtime/recorded_call.h"
#include "storage/reconstructions.h"

namespace sixpoint::correction {

runtime::Made<storage::ReconstructionRow> RecordOf(const clients::RegisteredBlade& blade,
                                                   const ReconstructionOrder& order, const AppliedRegions& regions,
                                                   const ReconstructedBlank& made);

}  // namespace sixpoint::correction
