// A stored correction as its message.
#pragma once

#include "sixpoint/correction/v1/correction.pb.h"
#include "storage/corrections.h"

namespace sixpoint::correction {

// With its program where the row was read with it.
v1::Correction ToProto(const storage::CorrectionRow& row);

// What a list's BASIC view has of it.
void LeaveBasic(v1::Correction* correction);

}  // namespace sixpoint::correction
