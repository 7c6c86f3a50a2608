// The work of Correct: every hole of the groups on the real blade, and the program moved onto them. Pure.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "metrology/correction/correct.h"
#include "metrology/correction/nc_proof.h"
#include "metrology/correction/release_gate.h"
#include "services/correction/inputs.h"
#include "sixpoint/correction/v1/correction.pb.h"

namespace sixpoint::correction {

struct Corrected {
  std::vector<metrology::CorrectedHoleGroup> groups;
  std::vector<CorrectedPath> paths;  // as Inputs::paths
  std::vector<metrology::GateCheck> checks;
  bool released = false;                    // every check passed
  std::optional<metrology::NcProof> proof;  // none where no template was sent
  std::string nc_program;                   // empty where no template was sent
};

// The offsets and tools that the request, or its machining model, states; they were let pass.
metrology::NcFrame FrameOf(const v1::CorrectRequest& request);

// FAILED_PRECONDITION with a reason: POSE_SINGULAR, POSE_OUT_OF_LIMITS. INVALID_ARGUMENT: a template that cannot be replaced, or
// whose program is not proven, whether or not it may be given now.
// CANCELLED where keep_going (may be empty) says no.
absl::StatusOr<Corrected> CorrectBlade(const Inputs& inputs, const std::function<bool()>& keep_going);

}  // namespace sixpoint::correction
