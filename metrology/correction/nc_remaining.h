// What is left of a program once some of its holes were cut (docs/nc_template.md, what is left).
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "metrology/correction/nc_frame.h"
#include "metrology/correction/nc_reader.h"
#include "metrology/correction/nc_target.h"

namespace sixpoint::metrology {

struct NcRemaining {
  std::string program;
  std::vector<NcMove> moves;  // its own, read back
};

// Of a program that was written and proven: the blocks that cut the holes in `cut` ("group/hole") are left out, and retracts between
// them that would lead down; a turn for the group is marked for the next hole of it; every other line stays as it is, and moves as it
// did: by feed or rapid, at its rate, by steps or not. Where the axes then stand, ProveProgram has to say, of the holes that are left.
// FAILED_PRECONDITION where it cannot be had so; INVALID_ARGUMENT as ReadNcProgram.
// targets: of the whole correction, for its paths: a path is cut as one, or left; FAILED_PRECONDITION where some of its poses are in `cut`.
// Empty: it has none.
absl::StatusOr<NcRemaining> LeaveOut(const std::string& program, const std::set<std::string>& cut,
                                     const std::array<char, 2>& rotary, const NcFrame& frame,
                                     const std::map<std::string, NcTarget>& targets = {});

}  // namespace sixpoint::metrology
