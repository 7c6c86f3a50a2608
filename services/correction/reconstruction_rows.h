// A reconstruction as it is kept.
#pragma once

#include "services/correction/reconstruct.h"
#include "services/runtime/recorded_call.h"
#include "storage/reconstructions.h"

namespace sixpoint::correction {

// Of the expanded uncertainties of patches: 95 %.
inline constexpr double kPatchCoverage = 2;

runtime::Made<storage::ReconstructionRow> RecordOf(const clients::RegisteredBlade& blade,
                                                   const ReconstructionOrder& order, const AppliedRegions& regions,
                                                   const ReconstructedBlank& made);

// As they are kept, each with its stock (unset: no wall looks alike) and its region; and the digest of that.
storage::BlankPatchesRow PatchesRowOf(const std::vector<metrology::BlankPatch>& patches,
                                      const std::vector<std::optional<double>>& stock_mm,
                                      const std::vector<std::size_t>& regions);
std::string DigestOf(const storage::BlankPatchesRow& patches);

}  // namespace sixpoint::correction
