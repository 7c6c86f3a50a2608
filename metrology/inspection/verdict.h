// Whether a value conforms, by a decision rule that has a name.
#pragma once

#include <optional>

namespace sixpoint::metrology {

// In order of severity, for the worst of several.
enum class Verdict { kConform = 0, kUndecidable = 1, kNotMeasured = 2, kNotConform = 3 };

inline constexpr const char* kDecisionRule =
    "ISO 14253-1: conform where value + U <= tolerance, not conform where value - U > tolerance, else undecidable; "
    "U = k u with k = 2";

// How a value is held against its limits (docs/methods/assessment.md).
struct DecisionRule {
  enum class Kind {
    kGuardBand,    // what is within guard_factor times U of a limit is neither conform nor not
    kProbability,  // conform where it is within its limits by 95 % or more, not conform where it is not by as much
  };
  Kind kind = Kind::kGuardBand;
  // Of U. 1: ISO 14253-1 until 2013; 0: simple acceptance. Of kProbability what that comes to beside one limit alone.
  double guard_factor = 1;
  // Of U: what is inside both limits by it conforms, however near they are to each other.
  double sure_guard_factor() const { return kind == Kind::kProbability ? 1.9599639845400545 / 2 : guard_factor; }

  // ISO 14253-1:2017: half of the one-sided normal quantile of 95 %.
  static DecisionRule Probability() { return {Kind::kProbability, 1.6448536269514722 / 2}; }
};

struct Limits {
  std::optional<double> lower, upper;  // none: there is none on that side
};

// All in one unit; the expanded uncertainty is twice the standard one. A value or uncertainty that is not finite is not measured.
Verdict Judge(double value, double expanded_uncertainty, const Limits& limits, const DecisionRule& rule);
// Of a non-negative error against its tolerance, by ISO 14253-1 as kDecisionRule says it.
Verdict Judge(double value, double expanded_uncertainty, double tolerance);

// The worst decides: one hole out of tolerance, or not measured, is never outweighed by the others.
Verdict Worst(Verdict first, Verdict second);

}  // namespace sixpoint::metrology
