#include "metrology/statistics/distributions.h"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace sixpoint::metrology {

double FisherUpperTail(double x, double numerator_freedom, double denominator_freedom) {
  if (std::isinf(x)) return 0;
  const boost::math::fisher_f distribution(numerator_freedom, denominator_freedom);
  return boost::math::cdf(boost::math::complement(distribution, x));
}

double FisherQuantile(double probability, double numerator_freedom, double denominator_freedom) {
  return boost::math::quantile(boost::math::fisher_f(numerator_freedom, denominator_freedom), probability);
}

double ChiSquaredQuantile(double probability, double freedom) {
  return boost::math::quantile(boost::math::chi_squared(freedom), probability);
}

double StudentQuantile(double probability, double freedom) {
  return boost::math::quantile(boost::math::students_t(freedom), probability);
}

}  // namespace sixpoint::metrology
