#include "metrology/sections/local_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "metrology/sections/outline.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double kCauchy = 2.385;  // as good as 95 % of least squares where errors are normal
constexpr double kSteepest = 1.5;  // of a curve over the direction it was started with

struct Solved {
  VectorXd coefficients, weights;
  MatrixXd by_heights;  // rows 0 and 1
  double variance = 0, freedom = 0;
};

Solved Solve(const MatrixXd& design, const VectorXd& heights, const VectorXd& counts, bool robust) {
  Solved solved;
  solved.weights = counts;
  for (int turn = 0;; ++turn) {
    const MatrixXd weighted = design.transpose() * solved.weights.asDiagonal();
    const MatrixXd normal = weighted * design;
    const Eigen::LDLT<MatrixXd> factor(normal);
    solved.coefficients = factor.solve(weighted * heights);
    const VectorXd residuals = heights - design * solved.coefficients;
    std::vector<double> magnitudes(static_cast<std::size_t>(residuals.size()));
    for (Eigen::Index i = 0; i < residuals.size(); ++i)
      magnitudes[static_cast<std::size_t>(i)] = std::abs(residuals[i]) * std::sqrt(counts[i]);
    const double scale = RobustSigmaOfMagnitudes(magnitudes);
    if (turn == 2 || !robust || !(scale > 0)) {
      // Rows 0 and 1 of normal^-1 design^T W.
      MatrixXd two = MatrixXd::Zero(normal.rows(), 2);
      two(0, 0) = two(1, 1) = 1;
      solved.by_heights = factor.solve(two).transpose() * weighted;
      solved.freedom = static_cast<double>(design.rows() - design.cols());
      if (solved.freedom > 0)
        solved.variance = (solved.weights.array() * residuals.array().square()).sum() / solved.freedom;
      return solved;
    }
    for (Eigen::Index i = 0; i < residuals.size(); ++i) {
      const double off = magnitudes[static_cast<std::size_t>(i)] / (kCauchy * scale);
      solved.weights[i] = counts[i] / (1 + off * off);  // never 0: what is left always determines the curve
    }
  }
}

}  // namespace

LocalFit::Range LocalFit::WindowOf(const FitWindow& window) const {
  const auto below = [&](double at_mm) {
    const double around = std::floor(at_mm / length_mm_);
    const double within = at_mm - around * length_mm_;
    const auto found = std::lower_bound(points_.begin(), points_.end(), within,
                                        [](const FitPoint& point, double at) { return point.at_mm < at; });
    return static_cast<std::int64_t>(found - points_.begin()) +
           static_cast<std::int64_t>(around) * static_cast<std::int64_t>(points_.size());
  };
  const auto n = static_cast<std::int64_t>(points_.size());
  const std::int64_t from = below(window.at_mm - window.below_mm);
  const std::int64_t to = std::min(below(window.at_mm + window.above_mm), from + n);
  return {static_cast<std::size_t>((from % n + n) % n), static_cast<std::size_t>(std::max<std::int64_t>(0, to - from))};
}

std::optional<LocalCurve> LocalFit::At(const FitWindow& window, const Vector2d& start_mm, Vector2d along) const {
  const Range range = WindowOf(window);
  if (range.count < 4) return std::nullopt;
  const auto rows = static_cast<Eigen::Index>(range.count);
  const int degree = std::min<int>(window.degree, static_cast<int>(range.count) - 3);
  const auto point = [&](Eigen::Index i) -> const FitPoint& {
    return points_[(range.first + static_cast<std::size_t>(i)) % points_.size()];
  };
  VectorXd counts(rows), beyond(rows);
  double lean = 0;
  for (Eigen::Index i = 0; i < rows; ++i) counts[i] = point(i).count, beyond[i] = point(i).beyond_mm;
  const double beyond_scale = beyond.cwiseAbs().maxCoeff();
  const bool fit_lean = !lean_known_ && beyond_scale > 1e-6 && rows > degree + 6;
  const double scale = std::max(window.below_mm, window.above_mm);
  MatrixXd design(rows, degree + 1 + (fit_lean ? 1 : 0));
  VectorXd heights(rows);
  Solved solved;
  Vector2d origin = start_mm;
  const Vector2d start_along = along;
  for (int turn = 0; turn < 3; ++turn) {  // about the tangent that the last turn found
    along.normalize();
    for (Eigen::Index i = 0; i < rows; ++i) {
      const Vector2d off = point(i).point_mm - origin;
      const double x = off.dot(along) / scale;
      heights[i] = off.dot(-LeftOf(along));
      design(i, 0) = 1;
      for (int k = 1; k <= degree; ++k) design(i, k) = design(i, k - 1) * x;
      if (fit_lean) design(i, degree + 1) = beyond[i] / beyond_scale;
    }
    solved = Solve(design, heights, counts, robust_);
    const double slope = degree > 0 ? solved.coefficients[1] / scale : 0;
    // What points clumped together leave open a lower degree does not.
    if (!(std::abs(slope) < kSteepest && std::abs(solved.coefficients[0]) < scale)) {
      if (degree <= 1) return std::nullopt;
      FitWindow lower = window;
      lower.degree = degree - 1;
      return At(lower, start_mm, start_along);
    }
    if (turn == 2 || (turn > 0 && std::abs(slope) < 1e-6)) break;
    origin += solved.coefficients[0] * -LeftOf(along);
    along -= slope * LeftOf(along);
  }
  LocalCurve curve;
  const double slope = degree > 0 ? solved.coefficients[1] / scale : 0;
  const Vector2d outward = -LeftOf(along);
  curve.point_mm = origin + solved.coefficients[0] * outward;
  curve.normal = (outward - slope * along).normalized();
  if (degree > 1)
    curve.curvature_per_mm = -2 * solved.coefficients[2] / (scale * scale) / std::pow(1 + slope * slope, 1.5);
  if (fit_lean) {
    lean = solved.coefficients[degree + 1] / beyond_scale;
  } else {
    for (Eigen::Index i = 0; i < rows; ++i) lean += counts[i] * point(i).lean;
    lean /= counts.sum();
  }
  curve.lean = lean;
  curve.first = range.first;
  for (Eigen::Index i = 0; i < rows; ++i) {
    curve.by_offset.push_back(static_cast<float>(solved.by_heights(0, i)));
    curve.by_slope.push_back(static_cast<float>(degree > 0 ? solved.by_heights(1, i) / scale : 0));
  }
  curve.sample_variance_mm2 = solved.variance;
  curve.freedom = solved.freedom;
  return curve;
}

}  // namespace sixpoint::metrology
