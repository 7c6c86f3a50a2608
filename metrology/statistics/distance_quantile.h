// The radius of the ball about the estimate that holds the true point with a stated probability.
#pragma once

#include <Eigen/Core>

namespace sixpoint::metrology {

// Distribution function of |x| for x ~ N(0, covariance), at radius >= 0: one-dimensional in the greatest eigenvalue's
// direction, in polar coordinates across it. Absolute error below 1e-8. The covariance may be singular.
double DistanceProbability(const Eigen::Matrix3d& covariance, double radius);

// Its inverse: |x| is below this with the probability (0 < probability < 1). Unit: square root of the covariance's.
double DistanceQuantile(const Eigen::Matrix3d& covariance, double probability);

}  // namespace sixpoint::metrology
