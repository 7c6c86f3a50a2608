// Probabilities and quantiles that tests and intervals need. Degrees of freedom are positive reals.
#pragma once

namespace sixpoint::metrology {

// Greater than x with probability.
double FisherUpperTail(double x, double numerator_freedom, double denominator_freedom);
// Less than or equal to the value with `probability`, in (0, 1).
double FisherQuantile(double probability, double numerator_freedom, double denominator_freedom);
double ChiSquaredQuantile(double probability, double freedom);
double StudentQuantile(double probability, double freedom);

}  // namespace sixpoint::metrology
