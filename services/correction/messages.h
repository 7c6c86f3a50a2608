// A stored correction as its message.
#pragma once

#include "sixpoint/correction/v1/correction.pb.h"
#include "storage/corrections.h"

namespace sixpoint::correction {

// With its program where the row was read with it.
v1::Correction ToProto(const storage::CorrectionRow& row);

}  // namespace sixpoint::correction
