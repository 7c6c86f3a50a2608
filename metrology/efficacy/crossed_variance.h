// How values of holes spread within a blade and between blades: value = hole + blade + noise, some missing (Henderson's third method;
// docs/methods/efficacy.md).
#pragma once

#include <optional>
#include <vector>

namespace sixpoint::metrology {

struct CrossedObservation {
  int blade = 0, hole = 0;  // counted from 0; at most one of each pair
  double value = 0;
};

struct CrossedVariance {
  // Of a hole about its own and its blade's mean; none: nothing is left to tell it.
  std::optional<double> within_variance;
  int within_freedom = 0;
  // Of the blades' effects, not below 0; none: fewer than two blades that share holes, or no variance within.
  std::optional<double> between_variance;
  int between_freedom = 0;
  bool between_negative = false;  // it came out below 0
  // Of the holes' own effects, the same on every blade, not below 0; none: fewer than two holes that share blades, or no variance within.
  std::optional<double> hole_variance;
  int hole_freedom = 0;
};

// Each of holes and blades after the other was taken off: what is the same on every blade is no spread of blades.
CrossedVariance AnalyseCrossed(const std::vector<CrossedObservation>& observations);

}  // namespace sixpoint::metrology
