// The work of Register: one fit, what the angles of its scans add, and how it agrees with the best fit. Pure.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "metrology/registration/allowance.h"
#include "metrology/registration/angle_influence.h"
#include "metrology/registration/disagreement.h"
#include "metrology/registration/registration.h"
#include "services/registration/inputs.h"

namespace sixpoint::registration {

struct Registered {
  metrology::PoseFit fit;
  std::optional<metrology::AllowanceFit> allowance;
  std::optional<metrology::Disagreement> disagreement;  // from the best fit of the same scans, where compared
  std::vector<metrology::AngleInfluence> angles;        // where axis tables were applied
  double seconds = 0;                                   // of computing
};

// INVALID_ARGUMENT: what the kernel refuses. CANCELLED: told to stop.
absl::StatusOr<Registered> RegisterBlade(const Inputs& inputs);

}  // namespace sixpoint::registration
