// What a person should know of a fit beside its figures, in words, added to its remark.
#pragma once

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "metrology/registration/best_fit.h"
#include "metrology/registration/disagreement.h"

namespace sixpoint::metrology {

// The scans of a blade, its CAD, and the machine they were taken on.
struct ScannedBlade {
  const Surface& surface;
  const std::vector<ScanPortion>& portions;
  const MachineCalibration& calibration;
};

// A converged fit that its points hold weakly: in which direction, and how well.
void RemarkWeakness(PoseFit* fit);

// What keeps a fit to the surface from being one: free directions, another size, the other hand. CANCELLED as FitToSurface.
absl::Status RemarkFailure(const ScannedBlade& blade, const Eigen::Isometry3d& zero_from_part_nominal,
                           const FitOptions& options, PoseFit* fit);

// The same of a blank, whose stock is no spread of its scans.
absl::Status RemarkBlankFailure(const ScannedBlade& blade, const Eigen::Isometry3d& zero_from_part_nominal,
                                const FitOptions& options, PoseFit* fit);

// Scans that put the surface at different places where they overlap. CANCELLED as FitToSurface.
absl::Status RemarkMerge(const ScannedBlade& blade, const FitOptions& options, PoseFit* fit);

// A disagreement beyond what is explained; nothing of another.
void RemarkDisagreement(const Disagreement& disagreement, FitEvidence* evidence);

}  // namespace sixpoint::metrology
