// How a fit ended. Only kConverged stands for a pose; the others are results with evidence, never errors.
#pragma once

namespace sixpoint::metrology {

enum class Outcome {
  kConverged,
  kNotConverged,
  kNotDetermined,     // the points leave at least one direction free, or a blank's side unseen
  kTooLittleOverlap,  // too few of the points lie on the surface
  kInfeasible,        // no pose near leaves the stock asked for (allowance.h)
};

}  // namespace sixpoint::metrology
