#include "metrology/inspection/stated_value.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sixpoint::metrology {
namespace {

constexpr double kNormalFactor = 1.959964;

struct Expanded {
  double uncertainty;
  UncertaintyBudget budget;
};

// scale: units of the budget in a unit of the value.
Expanded ExpandedBy(const ValueEffects& effects, const ValueBound& bound, double scale) {
  std::vector<UncertaintyComponent> components;
  double variance = 0;
  for (const ValueEffect& effect : effects) {
    const double more = effect.per_sigma.squaredNorm();
    variance += more;
    const auto same = std::find_if(components.begin(), components.end(),
                                   [&](const auto& component) { return component.source == effect.source; });
    if (same == components.end())
      components.push_back({effect.source, scale * scale * more, effect.degrees_of_freedom});
    else
      same->variance += scale * scale * more;
  }
  const double widening = WideningOf(kStatedProbability, EffectiveDegreesOfFreedom(components));
  if (bound.half > 0)
    components.push_back({bound.source, std::pow(scale * bound.half, 2) / 3, std::numeric_limits<double>::infinity()});
  return {kNormalFactor * widening * std::sqrt(variance) + bound.half, BudgetOf(std::move(components))};
}

}  // namespace

UncertaintyBudget BudgetOf(std::vector<UncertaintyComponent> components) {
  components.erase(
      std::remove_if(components.begin(), components.end(), [](const auto& one) { return !(one.variance > 0); }),
      components.end());
  std::stable_sort(components.begin(), components.end(),
                   [](const auto& one, const auto& other) { return one.variance > other.variance; });
  const double degrees_of_freedom = EffectiveDegreesOfFreedom(components);
  return {std::move(components), degrees_of_freedom};
}

void AddEffects(const ValueEffects& more, double factor, ValueEffects* sum) {
  for (const ValueEffect& effect : more) {
    const auto same = std::find_if(sum->begin(), sum->end(), [&](const ValueEffect& one) {
      return one.source == effect.source && one.owner == effect.owner &&
             one.per_sigma.size() == effect.per_sigma.size();
    });
    if (same == sum->end())
      sum->push_back({effect.source, effect.degrees_of_freedom, effect.owner, factor * effect.per_sigma});
    else
      same->per_sigma += factor * effect.per_sigma;
  }
}

StatedLength StateLength(double value_mm, const ValueEffects& effects_mm, const ValueBound& bound_mm) {
  Expanded expanded = ExpandedBy(effects_mm, bound_mm, 1e3);
  return {value_mm, expanded.uncertainty, std::move(expanded.budget)};
}

StatedAngle StateAngle(double value_rad, const ValueEffects& effects_rad) {
  Expanded expanded = ExpandedBy(effects_rad, {}, 1e6);
  return {value_rad, expanded.uncertainty, std::move(expanded.budget)};
}

StatedRatio StateRatio(double value, const ValueEffects& effects, const ValueBound& bound) {
  Expanded expanded = ExpandedBy(effects, bound, 1);
  return {value, expanded.uncertainty, std::move(expanded.budget)};
}

}  // namespace sixpoint::metrology
