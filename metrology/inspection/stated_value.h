// A value with its expanded uncertainty and the budget of it: how the value follows each cause, so that values which share causes can be
// added and subtracted with what is common cancelling as it does (docs/methods/inspection.md, values and their budgets).
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "metrology/uncertainty/error_source.h"

namespace sixpoint::metrology {

// The greatest first; what is nothing is left out.
struct UncertaintyBudget {
  std::vector<UncertaintyComponent> components;
  double degrees_of_freedom = std::numeric_limits<double>::infinity();  // of all together
};
UncertaintyBudget BudgetOf(std::vector<UncertaintyComponent> components);

inline constexpr double kStatedProbability = 0.95;

// Expanded uncertainties are those of 95 %, by Student's quantile (Welch and Satterthwaite).
struct StatedLength {
  double value_mm = 0, expanded_uncertainty_mm = 0;
  UncertaintyBudget budget;  // um^2
};
struct StatedAngle {
  double value_rad = 0, expanded_uncertainty_rad = 0;
  UncertaintyBudget budget;  // urad^2
};
struct StatedRatio {
  double value = 0, expanded_uncertainty = 0;
  UncertaintyBudget budget;  // of the ratio itself
};

// What one standard deviation of each of a cause's draws does to a value.
struct ValueEffect {
  static constexpr int kCommon = -1;
  std::string source;
  double degrees_of_freedom;
  int owner;  // the hole whose own draws they are; kCommon: of all of them
  Eigen::RowVectorXd per_sigma;
};
using ValueEffects = std::vector<ValueEffect>;

// sum += factor * more. Draws of one source and one owner are the same ones.
void AddEffects(const ValueEffects& more, double factor, ValueEffects* sum);

// bound: half of an interval in which a part of the value lies for sure, nobody knows where; the expanded uncertainty has it whole, the
// budget as evenly spread, by bound_source.
struct ValueBound {
  double half = 0;
  std::string source;
};
StatedLength StateLength(double value_mm, const ValueEffects& effects_mm, const ValueBound& bound_mm = {});
StatedAngle StateAngle(double value_rad, const ValueEffects& effects_rad);
StatedRatio StateRatio(double value, const ValueEffects& effects, const ValueBound& bound = {});

}  // namespace sixpoint::metrology
