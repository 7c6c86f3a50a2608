#include "metrology/inspection/verdict.h"

#include <cmath>

namespace sixpoint::metrology {

Verdict Judge(double value, double expanded_uncertainty, double tolerance) {
  if (!std::isfinite(value) || !std::isfinite(expanded_uncertainty) || !std::isfinite(tolerance) ||
      expanded_uncertainty < 0)
    return Verdict::kNotMeasured;
  if (value + expanded_uncertainty <= tolerance) return Verdict::kConform;
  if (value - expanded_uncertainty > tolerance) return Verdict::kNotConform;
  return Verdict::kUndecidable;
}

Verdict Worst(Verdict first, Verdict second) { return first < second ? second : first; }

}  // namespace sixpoint::metrology
