#include "metrology/inspection/verdict.h"

#include <cmath>

namespace sixpoint::metrology {
namespace {

constexpr double kEnough = 0.95;  // ISO 14253-1:2017, the default limit of conformance probability

double Below(double standard) { return 0.5 * std::erfc(-standard / std::sqrt(2.0)); }

Verdict ByProbability(double value, double expanded_uncertainty, const Limits& limits) {
  const double u = expanded_uncertainty / 2;
  const double above_upper = limits.upper ? Below((value - *limits.upper) / u) : 0;
  const double below_lower = limits.lower ? Below((*limits.lower - value) / u) : 0;
  const double outside = above_upper + below_lower;
  if (1 - outside >= kEnough) return Verdict::kConform;
  return outside >= kEnough ? Verdict::kNotConform : Verdict::kUndecidable;
}

}  // namespace

Verdict Judge(double value, double expanded_uncertainty, const Limits& limits, const DecisionRule& rule) {
  if (!std::isfinite(value) || !std::isfinite(expanded_uncertainty) || expanded_uncertainty < 0 ||
      (limits.lower && !std::isfinite(*limits.lower)) || (limits.upper && !std::isfinite(*limits.upper)))
    return Verdict::kNotMeasured;
  if (rule.kind == DecisionRule::Kind::kProbability && expanded_uncertainty > 0)
    return ByProbability(value, expanded_uncertainty, limits);
  const double guard = rule.guard_factor * expanded_uncertainty;
  if ((limits.upper && value - guard > *limits.upper) || (limits.lower && value + guard < *limits.lower))
    return Verdict::kNotConform;
  if ((!limits.upper || value + guard <= *limits.upper) && (!limits.lower || value - guard >= *limits.lower))
    return Verdict::kConform;
  return Verdict::kUndecidable;
}

Verdict Judge(double value, double expanded_uncertainty, double tolerance) {
  return Judge(value, expanded_uncertainty, {std::nullopt, tolerance}, {});
}

Verdict Worst(Verdict first, Verdict second) { return first < second ? second : first; }

}  // namespace sixpoint::metrology
