// A machine's record as the kernels' joint chain.
#pragma once

#include <absl/status/statusor.h>

#include "metrology/kinematics/joint_chain.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::runtime {

// Rotary joints without a point go through the nominal centre; limits of 0 and 0 were not stated. FAILED_PRECONDITION
// (reason KINEMATICS_UNSUITABLE) naming machine, joint, value and what was wanted.
absl::StatusOr<metrology::JointChain> ChainOf(const plant::v1::Machine& machine);

}  // namespace sixpoint::runtime
