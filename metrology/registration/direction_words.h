// Changes of a pose in words, by the part's own axes: what a person at the machine can do something about.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "metrology/registration/registration.h"

namespace sixpoint::metrology {

// A direction at zero as FitEvidence has it (rotation times the radius of gyration, translation): "shift along the part's
// z", "turn about the part's y", "shift along the part's z with a turn about the part's (0.71 0.00 0.71)". Empty for none.
std::string DirectionInWords(const Vector6d& direction, const Eigen::Isometry3d& zero_from_part);

// What the points leave free at that pose, direction by direction: "shift along the part's x, ...". Points count within
// reach_mm of the surface. Empty where they hold every direction that is free to move. CANCELLED as FitToSurface.
absl::StatusOr<std::string> FreeDirectionsInWords(const Surface& surface, const std::vector<ScanPortion>& portions,
                                                  const Eigen::Isometry3d& zero_from_part, double reach_mm,
                                                  const FitOptions& options);

}  // namespace sixpoint::metrology
