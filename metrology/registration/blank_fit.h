// A blank's pose from nowhere near: the coarse start, the allowance, and what its scans show of it.
#pragma once

#include <absl/status/statusor.h>

#include "metrology/registration/allowance.h"
#include "metrology/registration/remarks.h"

namespace sixpoint::metrology {

// FitWithAllowance from the nominal pose, or from a coarse start where the options ask for one. Its evidence holds scan by
// scan what lay within the greatest stock; too little of it is kTooLittleOverlap. Errors as FitWithAllowance.
absl::StatusOr<AllowanceFit> FitBlank(const ScannedBlade& blade, const Eigen::Isometry3d& zero_from_part_nominal,
                                      const AllowanceOptions& allowance, const FitOptions& options);

}  // namespace sixpoint::metrology
