// Whether the mean of independent vectors is 0 (Hotelling's T squared; docs/methods/efficacy.md).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace sixpoint::metrology {

struct MeanTest {
  int count = 0;
  Eigen::VectorXd mean;
  // Of the values, of count - 1 degrees of freedom; 0 for a single one.
  Eigen::MatrixXd covariance;
  // Of the mean: the root of covariance / count.
  Eigen::VectorXd standard_uncertainty;
  // All components at once: F = (v - p + 1) / (p v) m' V^-1 m with p and v - p + 1 degrees of freedom, V the covariance of the mean, v its
  // degrees of freedom. None: v < p.
  std::optional<double> f, p;
};

// What the values do not show, for all of them have it: added to the covariance of their mean.
struct CommonCovariance {
  Eigen::MatrixXd covariance;
  double degrees_of_freedom = 1;
};

// tr(m m) + tr(m)^2, by which Nel and van der Merwe weigh degrees of freedom.
double SquareSum(const Eigen::MatrixXd& m);

// Of vectors of the same size, one or more. What varies less than 1e-9 of its unit counts as varying by that. v is n - 1; with a common
// covariance that of Nel and van der Merwe (1986), in which case the rest of MeanTest is that of the values alone.
MeanTest TestMean(const std::vector<Eigen::VectorXd>& values,
                  const std::optional<CommonCovariance>& common = std::nullopt);

// The probability that a further vector of the same population lies as far from the mean of those before or farther. None: fewer than
// p + 1 before.
std::optional<double> FurtherOne(const std::vector<Eigen::VectorXd>& before, const Eigen::VectorXd& further);

}  // namespace sixpoint::metrology
