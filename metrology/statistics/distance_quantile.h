// The radius of the ball about the estimate that holds the true point with a stated probability.
#pragma once

#include <Eigen/Core>

namespace sixpoint::metrology {

// |x| for x ~ N(0, covariance) is below this with the probability (0 < probability < 1). Unit: square root of the covariance's.
// It inverts the distribution function: a quadrature along the direction of the greatest variance, in polar coordinates across
// it, to 1e-8. The covariance may be singular.
double DistanceQuantile(const Eigen::Matrix3d& covariance, double probability);

}  // namespace sixpoint::metrology
