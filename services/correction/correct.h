// The work of Correct: every hole of the groups on the real blade, and the program moved onto them. Pure.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "metrology/correction/correct.h"
#include "metrology/correction/nc_proof.h"
#include "services/correction/inputs.h"
#include "sixpoint/correction/v1/correction.pb.h"

namespace sixpoint::correction {

struct Corrected {
  std::vector<metrology::CorrectedHoleGroup> groups;
  std::vector<std::string> release_reasons;  // why a person has to release it; empty: nothing speaks against it
  std::optional<metrology::NcProof> proof;   // none where no template was sent
  std::string nc_program;                    // empty: no template was sent, or a person has to release it
};

// The offsets that the request states; CheckCorrect let them pass.
metrology::NcFrame FrameOf(const v1::CorrectRequest& request);

// FAILED_PRECONDITION with a reason: POSE_SINGULAR, POSE_OUT_OF_LIMITS. INVALID_ARGUMENT: a template that cannot be replaced, or
// whose program is not proven, whether or not it may be given now.
absl::StatusOr<Corrected> CorrectBlade(const v1::CorrectRequest& request, const Inputs& inputs);

}  // namespace sixpoint::correction
