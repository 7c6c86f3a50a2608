// A stored correction as its message.
#pragma once

#include <absl/status/statusor.h>

#include "sixpoint/correction/v1/correction.pb.h"
#include "storage/corrections.h"

namespace sixpoint::correction {

// Without its program. DATA_LOSS: a state that no service writes.
absl::StatusOr<v1::Correction> ToProto(const storage::CorrectionRow& row);
// With it, where it was released by rule, may be used, and the row was read with it.
absl::StatusOr<v1::Correction> WithProgram(const storage::CorrectionRow& row);

void SetProof(const storage::ProgramProofRow& row, v1::ProgramProof* proof);

// What a list's BASIC view has of it.
void LeaveBasic(v1::Correction* correction);

}  // namespace sixpoint::correction
