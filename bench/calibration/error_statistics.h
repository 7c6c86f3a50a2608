// Errors of many estimates beside their bound and beside what they report.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace sixpoint::bench {

// Not thread-safe: results are added in the order of their seeds, so that the sums do not depend on the threads.
class ErrorStatistics {
 public:
  ErrorStatistics(std::string kind, std::vector<std::string> parameters);
  // Error, the bound on any unbiased estimate's covariance, and the covariance that the estimate reports.
  void Add(const Eigen::VectorXd& error, const Eigen::MatrixXd& bound, const Eigen::MatrixXd& reported);

  int count() const { return count_; }
  int values() const { return count_ * static_cast<int>(parameters_.size()); }
  // Squared errors whitened by the bound: their sum, and their mean over parameters and runs (1: efficient).
  double whitened_squares() const { return whitened_squares_; }
  double variance_over_bound() const { return whitened_squares_ / values(); }
  double coverage_percent() const;  // of the reported 95 % intervals, over all parameters
  double coverage_scatter() const;  // its standard error; one run's parameters err together
  // Of 95 % intervals along the axes of each reported covariance: errors there are independent, so that chance moves it less
  // where one direction is held far less than the others and leads in every parameter.
  double axes_coverage_percent() const;
  double axes_coverage_scatter() const;
  double worst_bias_sigma() const;     // of one parameter, in its bound's standard deviations
  double reported_over_bound() const;  // standard uncertainties, root mean square, of the worst parameter
  void Print() const;                  // a row a parameter

 private:
  std::string kind_;
  std::vector<std::string> parameters_;
  Eigen::ArrayXd sum_, squares_, reported_squares_, covered_;  // in the bound's standard deviations
  double whitened_squares_ = 0;
  double covered_shares_squared_ = 0;  // of each run
  int axes_covered_ = 0;
  int count_ = 0;
};

}  // namespace sixpoint::bench
