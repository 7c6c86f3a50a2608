// A stored correction as its message.
#pragma once

#include <string>

#include "sixpoint/correction/v1/correction.pb.h"
#include "storage/corrections.h"

namespace sixpoint::correction {

v1::Correction ToProto(const storage::CorrectionRow& row, const std::string& nc_program);

}  // namespace sixpoint::correction
