// The few points that follow a pose from its start, before all of them are read.
#pragma once

#include <cstddef>
#include <vector>

#include "metrology/registration/fit_options.h"
#include "metrology/registration/surface_residuals.h"

namespace sixpoint::metrology {

// Spread evenly over the scans, about `count` of them, in pairs of neighbours; those that may lie in the regions asked for at
// this pose, give or take 5 mm.
std::vector<Sample> SamplesOf(const std::vector<ScanPortion>& portions, const Eigen::Isometry3d& zero_from_part,
                              const FitOptions& options, std::size_t count);

}  // namespace sixpoint::metrology
