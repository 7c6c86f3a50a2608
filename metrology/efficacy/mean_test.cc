#include "metrology/efficacy/mean_test.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "metrology/statistics/distributions.h"

namespace sixpoint::metrology {
namespace {

constexpr double kLeastVariance = 1e-18;

// x' S^-1 x, S as it is but for the floor.
double SquaredDistance(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& x) {
  const Eigen::MatrixXd floored =
      covariance + kLeastVariance * Eigen::MatrixXd::Identity(covariance.rows(), covariance.cols());
  return x.dot(floored.ldlt().solve(x));
}

}  // namespace

double SquareSum(const Eigen::MatrixXd& m) { return (m * m).trace() + m.trace() * m.trace(); }

MeanTest TestMean(const std::vector<Eigen::VectorXd>& values, const std::optional<CommonCovariance>& common) {
  MeanTest test;
  test.count = static_cast<int>(values.size());
  const Eigen::Index size = values.front().size();
  const double n = test.count, p = static_cast<double>(size);
  test.mean = Eigen::VectorXd::Zero(size);
  for (const Eigen::VectorXd& value : values) test.mean += value / n;
  test.covariance = Eigen::MatrixXd::Zero(size, size);
  if (test.count > 1)
    for (const Eigen::VectorXd& value : values)
      test.covariance += (value - test.mean) * (value - test.mean).transpose() / (n - 1);
  test.standard_uncertainty = (test.covariance.diagonal() / n).cwiseSqrt();
  if (n < 2) return test;
  Eigen::MatrixXd of_mean = test.covariance / n;
  double freedom = n - 1;
  if (common && common->covariance.trace() > 0) {
    const double parts = SquareSum(of_mean) / freedom + SquareSum(common->covariance) / common->degrees_of_freedom;
    of_mean += common->covariance;
    freedom = SquareSum(of_mean) / parts;
  }
  if (freedom < p) return test;
  test.f = (freedom - p + 1) / (p * freedom) * SquaredDistance(of_mean, test.mean);
  test.p = FisherUpperTail(*test.f, p, freedom - p + 1);
  return test;
}

std::optional<double> FurtherOne(const std::vector<Eigen::VectorXd>& before, const Eigen::VectorXd& further) {
  const double m = static_cast<double>(before.size()), p = static_cast<double>(further.size());
  if (m <= p) return std::nullopt;
  const MeanTest test = TestMean(before);
  const double t2 = m / (m + 1) * SquaredDistance(test.covariance, further - test.mean);
  return FisherUpperTail((m - p) / (p * (m - 1)) * t2, p, m - p);
}

}  // namespace sixpoint::metrology
