// One estimate a blade of what a machine is off by, from its holes (docs/methods/efficacy.md).
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "metrology/efficacy/efficacy.h"

namespace sixpoint::metrology {

// A hole as it is seen, and how much it counts: 1 / mm^2 and 1 / rad^2, each component.
struct WeighedOutcome {
  const HoleOutcome* outcome = nullptr;
  SeenOutcome seen;
  double position_weight = 0, direction_weight = 0;
};
using SeenBlade = std::vector<WeighedOutcome>;

// No hole counts for more than one of the median uncertainty: what an inspection states as small leaves out what makes holes differ.
std::vector<SeenBlade> SeeAll(const std::vector<BladeOutcome>& blades, const RotaryAxes& axes);

// Which of X, Y, Z, and of X, Y, Z, a, b, the holes of all blades determine, and how well together.
struct Determined {
  std::vector<int> positions;              // columns 0 to 2
  std::vector<int> angles;                 // columns 3 and 4
  std::optional<double> condition_number;  // of all of these, columns scaled to unit length; none without angles
};
Determined WhatIsDetermined(const std::vector<SeenBlade>& blades);

// What a hole's own deviation, the same on every blade, does to the mean of the blades' estimates (rows: columns asked for).
struct HoleGain {
  Eigen::MatrixXd by_position, by_direction;
};
// The blades' estimates of these columns, by weighted least squares; a blade that does not determine them all is left out, its index with it.
struct BladeEstimates {
  std::vector<Eigen::VectorXd> values;
  std::vector<std::size_t> blades;
  std::map<std::string, HoleGain> gains;
};
BladeEstimates EstimateEach(const std::vector<SeenBlade>& blades, const std::vector<int>& columns);

// Standard uncertainties of X, Y, Z (mm) and of the angles (rad) that all blades share: mean squares over the holes. lever: with the
// angles estimated too, their error turns into one of the position.
struct SharedUncertainty {
  double position_mm = 0, angle_rad = 0, lever_mm = 0;
};
SharedUncertainty SharedBy(const std::vector<SeenBlade>& blades);

}  // namespace sixpoint::metrology
