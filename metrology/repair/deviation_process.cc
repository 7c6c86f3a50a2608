#include "metrology/repair/deviation_process.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "metrology/linear_algebra/least_squares.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

// In parts of the span from the first to the last known height.
constexpr std::array<double, 3> kSlowLengths = {0.8, 1.4, 2.4};
constexpr std::array<double, 6> kWaveLengths = {0.08, 0.12, 0.18, 0.27, 0.4, 0.6};
constexpr std::array<double, 5> kWaveShares = {1e-3, 1e-2, 0.1, 0.4, 1};  // of the variance
constexpr double kLeastNoise = 1e-7, kNoiseStep = 3.1622776601683795;     // of the variance; steps of the grid
constexpr int kNoises = 20;

constexpr std::size_t kLeastBelow = 8, kLeastAhead = 3;
constexpr double kAsTold = 4;  // series that are taken to have come as told

// Matern's covariance of order 7/2: smooth as a blade's deviation is, but not so that a piece of it tells the rest for certain, as of a
// Gaussian one.
double Matern(double distance, double length) {
  const double x = std::sqrt(7.0) * distance / length;
  return (1 + x + 2 * x * x / 5 + x * x * x / 15) * std::exp(-x);
}

Eigen::MatrixXd Rows(const std::vector<double>& places) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(places.size()), 2);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) << 1, places[static_cast<std::size_t>(i)];
  return rows;
}

template <typename Covariance>
Eigen::MatrixXd Between(const std::vector<double>& one, const std::vector<double>& other,
                        const Covariance& covariance) {
  Eigen::MatrixXd made(static_cast<Eigen::Index>(one.size()), static_cast<Eigen::Index>(other.size()));
  for (Eigen::Index i = 0; i < made.rows(); ++i)
    for (Eigen::Index k = 0; k < made.cols(); ++k)
      made(i, k) = covariance(std::abs(one[static_cast<std::size_t>(i)] - other[static_cast<std::size_t>(k)]));
  return made;
}

}  // namespace

Eigen::VectorXd WithoutWild(const std::vector<double>& z_mm, const Eigen::VectorXd& values) {
  constexpr Eigen::Index kNear = 5;
  constexpr double kWildSigmas = 5;
  const Eigen::Index count = values.size();
  Eigen::VectorXd by_neighbours(count);
  std::vector<double> off;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index first = std::clamp<Eigen::Index>(i - kNear, 0, std::max<Eigen::Index>(0, count - 2 * kNear - 1));
    const Eigen::Index end = std::min(count, first + 2 * kNear + 1);
    Eigen::VectorXd weights = Eigen::VectorXd::Ones(end - first), curve;
    Eigen::MatrixXd rows(end - first, 3);
    const double reach_mm = std::abs(z_mm[static_cast<std::size_t>(end - 1)] - z_mm[static_cast<std::size_t>(first)]);
    for (Eigen::Index k = 0; k < rows.rows(); ++k) {
      const double x = (z_mm[static_cast<std::size_t>(first + k)] - z_mm[static_cast<std::size_t>(i)]) / reach_mm;
      rows.row(k) << 1, x, x * x;
    }
    weights[i - first] = 0;
    for (int turn = 0; turn < 16; ++turn) {
      curve = LeastSquares(weights.asDiagonal() * rows, weights.cwiseProduct(values.segment(first, end - first)));
      const Eigen::ArrayXd left = (rows * curve - values.segment(first, end - first)).array().abs();
      std::vector<double> magnitudes(left.data(), left.data() + left.size());
      const double limit = 2 * std::max(1e-12, RobustSigmaOfMagnitudes(std::move(magnitudes)));
      weights = (left / limit).max(1.0).inverse();
      weights[i - first] = 0;
    }
    by_neighbours[i] = curve[0];
    off.push_back(std::abs(values[i] - by_neighbours[i]));
  }
  const double limit = kWildSigmas * RobustSigmaOfMagnitudes(off);
  Eigen::VectorXd kept = values;
  for (Eigen::Index i = 0; i < count; ++i)
    if (off[static_cast<std::size_t>(i)] > limit) kept[i] = by_neighbours[i];
  return kept;
}

HeightProcess::HeightProcess(const std::vector<double>& known_mm, const std::vector<double>& asked_mm) {
  const auto [low, high] = std::minmax_element(known_mm.begin(), known_mm.end());
  const double middle_mm = (*low + *high) / 2, span_mm = *high - *low;
  std::vector<double> known, asked;
  for (const double z : known_mm) known.push_back((z - middle_mm) / span_mm);
  for (const double z : asked_mm) asked.push_back((z - middle_mm) / span_mm);
  const Eigen::MatrixXd rows = Rows(known), asked_rows = Rows(asked);
  by_line_.resize(asked_rows.rows(), rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    by_line_.col(i) = asked_rows * LeastSquares(rows, Eigen::VectorXd::Unit(rows.rows(), i));
  line_growth_ = by_line_.rowwise().squaredNorm();
  // The directions that no line reaches: of the projection off it, all but two.
  Eigen::MatrixXd off_line = Eigen::MatrixXd::Identity(rows.rows(), rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    off_line.col(i) -= rows * LeastSquares(rows, Eigen::VectorXd::Unit(rows.rows(), i));
  const Eigen::MatrixXd free = EigenSystemOf(off_line).vectors.rightCols(rows.rows() - 2);
  const auto add = [&](double slow, double wave, double share) {
    const auto covariance = [&](double distance) {
      return (1 - share) * Matern(distance, slow) + share * Matern(distance, wave);
    };
    const Eigen::MatrixXd inner = Between(known, known, covariance), cross = Between(asked, known, covariance);
    const EigenSystem system = EigenSystemOf(Eigen::MatrixXd(free.transpose() * inner * free));
    Kernel kernel;
    kernel.eigenvalues = system.values.cwiseMax(0);
    kernel.contrasts = (free * system.vectors).transpose();
    kernel.weights = (cross - by_line_ * inner) * kernel.contrasts.transpose();
    kernel.variance.resize(asked_rows.rows());
    for (Eigen::Index i = 0; i < kernel.variance.size(); ++i)
      kernel.variance[i] =
          1 - 2 * cross.row(i).dot(by_line_.row(i)) + by_line_.row(i).dot(inner * by_line_.row(i).transpose());
    kernels_.push_back(std::move(kernel));
  };
  for (const double slow : kSlowLengths) {
    add(slow, slow, 0);
    for (const double wave : kWaveLengths)
      for (const double share : kWaveShares) add(slow, wave, share);
  }
}

std::vector<ProcessValue> HeightProcess::Predict(const Eigen::VectorXd& values) const {
  struct Choice {
    std::size_t kernel = 0;
    double noise = 0, scale = 0, log_likelihood = 0;
  };
  std::vector<Choice> choices;
  const auto freedom = static_cast<double>(kernels_[0].eigenvalues.size());
  std::vector<Eigen::VectorXd> seen;
  double greatest = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < kernels_.size(); ++k) {
    seen.push_back(kernels_[k].contrasts * values);
    double noise = kLeastNoise;
    for (int step = 0; step < kNoises; ++step, noise *= kNoiseStep) {
      const Eigen::ArrayXd total = kernels_[k].eigenvalues.array() + noise;
      const double squares = (seen[k].array().square() / total).sum();
      Choice choice{k, noise, squares / freedom, 0};
      choice.log_likelihood = -0.5 * total.log().sum() - freedom / 2 * std::log(std::max(squares, 1e-300));
      greatest = std::max(greatest, choice.log_likelihood);
      choices.push_back(choice);
    }
  }
  const Eigen::VectorXd by_line = by_line_ * values;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(by_line.size()), square = mean, variance = mean;
  double all = 0, noise_variance = 0;
  constexpr double kSmallestShare = -12;  // log, beside the likeliest
  for (const Choice& choice : choices) {
    if (choice.log_likelihood < greatest + kSmallestShare) continue;
    const Kernel& kernel = kernels_[choice.kernel];
    const double share = std::exp(choice.log_likelihood - greatest);
    const Eigen::ArrayXd inverse = 1 / (kernel.eigenvalues.array() + choice.noise);
    const Eigen::VectorXd found = by_line + kernel.weights * (seen[choice.kernel].array() * inverse).matrix();
    const Eigen::VectorXd told = (kernel.weights.array().square().matrix() * inverse.matrix());
    // Student's: the scale is known by its contrasts alone.
    const double scale = choice.scale * freedom / (freedom - 2);
    variance += share * scale * (kernel.variance + choice.noise * line_growth_ - told).cwiseMax(0);
    noise_variance += share * scale * choice.noise;
    mean += share * found;
    square += share * (found - by_line).cwiseAbs2();
    all += share;
  }
  std::vector<ProcessValue> predicted;
  for (Eigen::Index i = 0; i < mean.size(); ++i) {
    const double at = mean[i] / all, off = at - by_line[i];
    predicted.push_back({at, variance[i] / all + std::max(0.0, square[i] / all - off * off), noise_variance / all});
  }
  return predicted;
}

namespace {

// How many known heights are left below, so that the others lie as far above them, in parts of their span, as the asked one above all.
std::size_t BelowOf(const std::vector<double>& known_mm, double asked_mm) {
  const double part = (known_mm.back() - known_mm.front()) / (asked_mm - known_mm.front());
  const double up_to_mm = known_mm.front() + part * (known_mm.back() - known_mm.front());
  const auto above = std::upper_bound(known_mm.begin(), known_mm.end(), up_to_mm);
  return std::clamp(static_cast<std::size_t>(above - known_mm.begin()), kLeastBelow, known_mm.size() - kLeastAhead);
}

}  // namespace

Foresight::Foresight(const std::vector<double>& known_mm, double asked_mm)
    : below_(static_cast<Eigen::Index>(BelowOf(known_mm, asked_mm))),
      process_({known_mm.begin(), known_mm.begin() + below_}, {known_mm.begin() + below_, known_mm.end()}) {}

double Foresight::Growth(const Eigen::MatrixXd& series) const {
  double off = kAsTold;
  for (Eigen::Index s = 0; s < series.cols(); ++s) {
    const std::vector<ProcessValue> told = process_.Predict(series.col(s).head(below_));
    double squares = 0, variances = 0;
    for (std::size_t i = 0; i < told.size(); ++i) {
      squares += std::pow(series(below_ + static_cast<Eigen::Index>(i), s) - told[i].mean, 2);
      variances += told[i].variance + told[i].noise_variance;
    }
    off += variances > 0 ? squares / variances : 1;
  }
  return std::max(1.0, off / (kAsTold + static_cast<double>(series.cols())));
}

}  // namespace sixpoint::metrology
