// Decision rule of ISO 14253-1: a value conforms only when it is inside the tolerance by its expanded uncertainty.
#pragma once

namespace sixpoint::metrology {

// In order of severity, for the worst of several.
enum class Verdict { kConform = 0, kUndecidable = 1, kNotMeasured = 2, kNotConform = 3 };

inline constexpr const char* kDecisionRule =
    "ISO 14253-1: conform where value + U <= tolerance, not conform where value - U > tolerance, else undecidable; "
    "U = k u with k = 2";

// Of a non-negative error against its tolerance, in one unit. A value or uncertainty that is not finite is not measured.
Verdict Judge(double value, double expanded_uncertainty, double tolerance);

// The worst decides: one hole out of tolerance, or not measured, is never outweighed by the others.
Verdict Worst(Verdict first, Verdict second);

}  // namespace sixpoint::metrology
