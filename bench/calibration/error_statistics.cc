#include "bench/calibration/error_statistics.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>

namespace sixpoint::bench {

ErrorStatistics::ErrorStatistics(std::string kind, std::vector<std::string> parameters)
    : kind_(std::move(kind)), parameters_(std::move(parameters)) {
  const auto size = static_cast<Eigen::Index>(parameters_.size());
  sum_ = squares_ = reported_squares_ = covered_ = Eigen::ArrayXd::Zero(size);
}

void ErrorStatistics::Add(const Eigen::VectorXd& error, const Eigen::MatrixXd& bound, const Eigen::MatrixXd& reported) {
  constexpr double kTwoSided95 = 1.959963984540054;
  const Eigen::ArrayXd sigma = bound.diagonal().array().sqrt();
  const Eigen::ArrayXd relative = error.array() / sigma;
  sum_ += relative;
  squares_ += relative.square();
  reported_squares_ += reported.diagonal().array() / sigma.square();
  const Eigen::ArrayXd covered =
      (error.array().abs() <= kTwoSided95 * reported.diagonal().array().sqrt()).cast<double>();
  covered_ += covered;
  covered_shares_squared_ += covered.mean() * covered.mean();
  // Scaled to unit diagonal first: rad and mm differ by orders of magnitude.
  const Eigen::VectorXd inverse_sigma = sigma.inverse();
  const Eigen::MatrixXd correlation = inverse_sigma.asDiagonal() * bound * inverse_sigma.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> whiten(correlation);
  whitened_squares_ += whiten.matrixL().solve(relative.matrix()).squaredNorm();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(inverse_sigma.asDiagonal() * reported *
                                                            inverse_sigma.asDiagonal());
  const Eigen::ArrayXd along = (axes.eigenvectors().transpose() * relative.matrix()).array();
  axes_covered_ += static_cast<int>((along.square() <= kTwoSided95 * kTwoSided95 * axes.eigenvalues().array()).count());
  ++count_;
}

double ErrorStatistics::coverage_percent() const { return 100 * covered_.sum() / values(); }
double ErrorStatistics::coverage_scatter() const {
  const double share = coverage_percent() / 100;
  return 100 * std::sqrt(std::max(0.0, covered_shares_squared_ / count_ - share * share) / count_);
}
double ErrorStatistics::axes_coverage_percent() const { return 100.0 * axes_covered_ / values(); }
double ErrorStatistics::axes_coverage_scatter() const {
  const double share = axes_coverage_percent() / 100;
  return 100 * std::sqrt(share * (1 - share) / values());
}
double ErrorStatistics::worst_bias_sigma() const { return (sum_ / count_).abs().maxCoeff(); }
double ErrorStatistics::reported_over_bound() const { return std::sqrt((reported_squares_ / count_).maxCoeff()); }

void ErrorStatistics::Print() const {
  std::printf("%-24s %12s %12s %20s %12s\n", kind_.c_str(), "bias/sigma", "mse/bound", "reported/bound sigma",
              "coverage %");
  for (Eigen::Index k = 0; k < sum_.size(); ++k)
    std::printf("%-24s %12.3f %12.3f %20.3f %12.1f\n", parameters_[static_cast<std::size_t>(k)].c_str(),
                sum_(k) / count_, squares_(k) / count_, std::sqrt(reported_squares_(k) / count_),
                100 * covered_(k) / count_);
  // Chance alone moves a parameter's mean square over n runs by sqrt(2 / n) of its expectation.
  std::printf(
      "%-24s %12s %12.3f %20s %12.1f   %d runs, whitened by the whole bound; a parameter's mse scatters by %.2f\n",
      "pooled", "", variance_over_bound(), "", coverage_percent(), count_, std::sqrt(2.0 / count_));
  std::printf(
      "%-24s coverage of the parameters %.2f +- %.2f %%, along the reported covariance's axes %.2f +- %.2f %%\n", "",
      coverage_percent(), coverage_scatter(), axes_coverage_percent(), axes_coverage_scatter());
}

}  // namespace sixpoint::bench
