// A correction that was computed as it is recorded: its row and its journal entry.
#pragma once

#include <absl/status/statusor.h>

#include "services/correction/correct.h"
#include "services/correction/inputs.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "storage/corrections.h"

namespace sixpoint::correction {

storage::ProgramProofRow RowOf(const metrology::NcProof& proof);

// With a new id.
runtime::Made<storage::CorrectionRow> RecordOf(const Inputs& inputs, const Corrected& corrected);

}  // namespace sixpoint::correction
