// Changes of a pose in words, by the part's own axes: what a person at the machine can do something about.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "metrology/registration/fit_options.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// From this condition number on a direction is called weakly held: the best held one is known so many times better. The
// condition tells it, not the stated uncertainty: noise is stated rightly however weak a direction, but a smooth deviation of
// the part's shape, which no scan tells from a pose, goes into the weakest direction by a tenth to a fifth of the condition.
// Measured with 5 um of it: error over stated 1.0 to 2.0 up to a condition of 9, 2.9 at 39, 6 and more beyond 190
// (bench/registration, part weakness).
constexpr double kWeakCondition = 20;

// A direction at zero as FitEvidence has it (rotation times the radius of gyration, translation): "shift along the part's
// z", "turn about the part's y", "shift along the part's z with a turn about the part's (0.71 0.00 0.71)". Empty for none.
std::string DirectionInWords(const Vector6d& direction, const Eigen::Isometry3d& zero_from_part);

// What the points leave free at that pose, direction by direction: "shift along the part's x, ...". Points count within
// reach_mm of the surface. Empty where they hold every direction that is free to move. CANCELLED as FitToSurface.
absl::StatusOr<std::string> FreeDirectionsInWords(const Surface& surface, const std::vector<ScanPortion>& portions,
                                                  const Eigen::Isometry3d& zero_from_part, double reach_mm,
                                                  const FitOptions& options);

}  // namespace sixpoint::metrology
