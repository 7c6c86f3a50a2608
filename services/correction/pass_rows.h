// Machining passes as they are kept, and as messages.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "services/clients/registered_blade.h"
#include "services/correction/next_pass.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/correction/v1/machining_pass.pb.h"
#include "storage/corrections.h"
#include "storage/machining_passes.h"

namespace sixpoint::correction {

// With a new id.
runtime::Made<storage::MachiningPassRow> RecordOf(const clients::RegisteredBlade& blade,
                                                  const storage::CorrectionRow& correction, int number,
                                                  const Shape& shape, const LeftByPass& left);

// DATA_LOSS: words that this release does not know.
absl::StatusOr<v1::MachiningPass> ToProto(const storage::MachiningPassRow& row);
void LeaveBasic(v1::MachiningPass* pass);

}  // namespace sixpoint::correction
