// What has to be true of a correction before its program is used without a person looking at it (docs/methods/release.md).
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "metrology/correction/nc_reader.h"
#include "metrology/correction/nc_target.h"
#include "metrology/correction/release_gate.h"
#include "services/correction/correct.h"

namespace sixpoint::correction {

// A written program as it was read back; empty where no template was sent.
struct ReadProgram {
  std::vector<metrology::NcMove> moves;
  std::map<std::string, metrology::NcTarget> targets;
  std::array<double, 2> tip_below_mm{};  // least and greatest of the stated tools' lengths
};

// Each question that there is an answer to look for, in the order of their kinds. CANCELLED by the caller.
absl::StatusOr<std::vector<metrology::GateCheck>> Judge(const Inputs& inputs, const Corrected& corrected,
                                                        const ReadProgram& program,
                                                        const std::function<bool()>& keep_going);

}  // namespace sixpoint::correction
