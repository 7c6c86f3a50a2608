// What a machine is off by, from blades as the independent units and holes as a sample of a part's (docs/methods/efficacy.md).
#pragma once

#include <vector>

#include "metrology/efficacy/blade_estimates.h"

namespace sixpoint::metrology {

struct Offsets {
  OffsetTest position, angles;
  bool angles_used = false;
  std::vector<OffsetEstimate> offsets;
  Eigen::Vector2d angle_values = Eigen::Vector2d::Zero();  // to be taken off: 0 where they are not used
};

// Offsets and angles are tested at half the level each, so that a machine that is off by nothing is offered something in at most
// 1 - confidence.
Offsets EstimateOffsets(const std::vector<SeenBlade>& blades, const Determined& determined,
                        const BladeEstimates& positions_alone, double confidence);

// Of one component of the positions (0 to 2; mm), or of the directions (rad), what the angles explain taken off.
CrossedVariance SpreadOf(const std::vector<SeenBlade>& blades, int column, const Eigen::Vector2d& angles,
                         bool of_directions);

}  // namespace sixpoint::metrology
