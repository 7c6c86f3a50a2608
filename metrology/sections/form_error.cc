#include "metrology/sections/form_error.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "metrology/sections/profile.h"
#include "metrology/statistics/legendre.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr int kStations = 48;
constexpr int kLengths = 9, kSigmas = 22;
constexpr double kLeastSigmaMm = 5e-5, kGreatestSigmaMm = 0.2;
constexpr int kShapeDegree = 4;

struct Series {
  VectorXd at_mm, values_mm, noise_mm2;
  MatrixXd trend;
};

// At the stations the mean of each circle near it.
struct Stations {
  std::vector<double> at_mm, half_mm;  // along the camber line
  std::vector<Vector2d> centres_mm, across;
};

Stations StationsOf(const Camber& camber) {
  Stations stations;
  const Vector2d line = camber.circles.back().centre_mm - camber.circles.front().centre_mm;
  // Within a thickness of an end the curve is the end's.
  const double from_mm = camber.circles.front().along_mm + camber.circles.front().radius_mm;
  const double step_mm = (camber.circles.back().along_mm - camber.circles.back().radius_mm - from_mm) / kStations;
  for (int k = 0; k < kStations; ++k) {
    const double low_mm = from_mm + step_mm * k, high_mm = low_mm + step_mm;
    Vector2d centre = Vector2d::Zero(), across = Vector2d::Zero();
    double half = 0, count = 0;
    for (const InscribedCircle& circle : camber.circles) {
      if (circle.along_mm < low_mm || circle.along_mm >= high_mm) continue;
      const Vector2d left = circle.normal - circle.other_normal;
      centre += circle.centre_mm;
      half += circle.radius_mm;
      // Of a line that turns far: to the side of the last one.
      const Vector2d side = stations.across.empty() ? LeftOf(line) : stations.across.back();
      across += left.dot(side) > 0 ? left : Vector2d(-left);
      ++count;
    }
    if (count == 0) continue;
    stations.centres_mm.push_back(centre / count);
    stations.half_mm.push_back(half / count);
    stations.across.push_back(across.normalized());
  }
  for (std::size_t i = 0; i < stations.centres_mm.size(); ++i)
    stations.at_mm.push_back(
        i == 0 ? 0 : stations.at_mm.back() + (stations.centres_mm[i] - stations.centres_mm[i - 1]).norm());
  return stations;
}

// Two series: the outward sum and difference of both sides, halved.
std::vector<Series> SeriesOf(const Stations& stations, const Outline& measured, const Outline* nominal,
                             double noise_mm2) {
  const auto n = static_cast<Eigen::Index>(stations.at_mm.size());
  Series thickness, line;
  thickness.at_mm = line.at_mm = Eigen::Map<const VectorXd>(stations.at_mm.data(), n);
  thickness.noise_mm2 = line.noise_mm2 = VectorXd::Constant(n, noise_mm2);
  thickness.values_mm = line.values_mm = VectorXd::Zero(n);
  const double length_mm = stations.at_mm.back();
  if (nominal != nullptr) {
    const ProfileDeviation deviation = DeviationFrom(*nominal, measured);
    thickness.trend = MatrixXd(n, 2);
    line.trend = MatrixXd(n, 2);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const auto off = [&](double side) {
        const Vector2d at = stations.centres_mm[k] + side * stations.half_mm[k] * stations.across[k];
        return SignedDistance(*nominal, deviation.nominal_from_measured * measured.PointAt(measured.Nearest(at)),
                              nullptr);
      };
      const double left = off(1), right = off(-1);
      thickness.values_mm[i] = (left + right) / 2;
      line.values_mm[i] = (left - right) / 2;
      const double t = 2 * thickness.at_mm[i] / length_mm - 1;
      thickness.trend.row(i) << 1, t;
      line.trend.row(i) << 1, t;
    }
    return {thickness, line};
  }
  thickness.trend = MatrixXd(n, kShapeDegree + 1);
  line.trend = MatrixXd(n, 2 * (kShapeDegree + 1));
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto legendre = Legendre<kShapeDegree>(2 * thickness.at_mm[i] / length_mm - 1);
    thickness.values_mm[i] = stations.half_mm[k];
    line.values_mm[i] = stations.across[k].dot(stations.centres_mm[k] - stations.centres_mm[0]);
    for (int j = 0; j <= kShapeDegree; ++j) {
      thickness.trend(i, j) = legendre[static_cast<std::size_t>(j)];
      // A camber line whose places are polynomials: across itself by its own direction.
      line.trend(i, 2 * j) = legendre[static_cast<std::size_t>(j)] * stations.across[k].x();
      line.trend(i, 2 * j + 1) = legendre[static_cast<std::size_t>(j)] * stations.across[k].y();
    }
  }
  return {thickness, line};
}

double LogLikelihood(const Series& series, double sigma_mm, double length_mm) {
  const Eigen::Index n = series.at_mm.size();
  MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const double apart = (series.at_mm[i] - series.at_mm[j]) / length_mm;
      // Of half a sum of two sides: half the variance of one.
      covariance(i, j) = 0.5 * sigma_mm * sigma_mm * std::exp(-0.5 * apart * apart);
    }
  covariance.diagonal() += series.noise_mm2;
  covariance.diagonal().array() += 1e-3 * 0.5 * sigma_mm * sigma_mm;
  const Eigen::LLT<MatrixXd> factor(covariance);
  const MatrixXd trend = factor.matrixL().solve(series.trend);
  const VectorXd values = factor.matrixL().solve(series.values_mm);
  const MatrixXd normal = trend.transpose() * trend + 1e-12 * MatrixXd::Identity(trend.cols(), trend.cols());
  const Eigen::LLT<MatrixXd> squares(normal);
  const VectorXd residuals = values - trend * squares.solve(trend.transpose() * values);
  const auto log_root = [](const Eigen::LLT<MatrixXd>& of) {
    return MatrixXd(of.matrixL()).diagonal().array().log().sum();
  };
  return -log_root(factor) - log_root(squares) - 0.5 * residuals.squaredNorm();
}

}  // namespace

FormError FormErrorOf(const FittedOutline& fitted, const Camber& camber, const Outline* nominal) {
  FormError found;
  found.from_nominal = nominal != nullptr;
  if (camber.circles.size() < 20) return found;
  const Stations stations = StationsOf(camber);
  if (stations.at_mm.size() < 16) return found;
  // Of a station: the noise of a node, halved by two sides.
  std::vector<double> node_variances;
  for (const NodeNoise& noise : fitted.noise) {
    double variance = 0;
    for (std::size_t k = 0; k < noise.by_offset.size(); ++k)
      variance += std::pow(static_cast<double>(noise.by_offset[k]) *
                               fitted.mean_sigma_mm[(noise.first + k) % fitted.mean_sigma_mm.size()],
                           2);
    node_variances.push_back(variance);
  }
  const double noise_mm2 = Median(node_variances) / 2 + 1e-10;
  const std::vector<Series> all = SeriesOf(stations, fitted.outline, nominal, noise_mm2);
  const double whole_mm = stations.at_mm.back(), shortest_mm = 1.5 * whole_mm / kStations;
  const double longest_mm = whole_mm / 4;
  double best = -INFINITY;
  for (int i = 0; i < kLengths; ++i)
    for (int k = 0; k < kSigmas; ++k) {
      FormChoice choice;
      choice.length_mm = shortest_mm * std::pow(longest_mm / shortest_mm, i / (kLengths - 1.0));
      choice.sigma_mm = kLeastSigmaMm * std::pow(kGreatestSigmaMm / kLeastSigmaMm, k / (kSigmas - 1.0));
      for (const Series& series : all) choice.share += LogLikelihood(series, choice.sigma_mm, choice.length_mm);
      best = std::max(best, choice.share);
      found.choices.push_back(choice);
    }
  double sum = 0;
  for (FormChoice& choice : found.choices) sum += choice.share = std::exp(choice.share - best);
  std::stable_sort(found.choices.begin(), found.choices.end(),
                   [](const FormChoice& a, const FormChoice& b) { return a.share > b.share; });
  double mean = 0, squares = 0;
  for (FormChoice& choice : found.choices) {
    choice.share /= sum;
    mean += choice.share * std::pow(choice.sigma_mm, 2);
    squares += choice.share * std::pow(choice.sigma_mm, 4);
  }
  found.sigma_mm = std::sqrt(mean);
  found.length_mm = found.choices.front().length_mm;
  const double spread = squares - mean * mean;
  found.freedom = spread > 0 ? std::clamp(2 * mean * mean / spread, 3.0, 1e6) : 1e6;
  return found;
}

}  // namespace sixpoint::metrology
