#include "metrology/studies/sphere_check.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "metrology/linear_algebra/least_squares.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr int kMostIterations = 50;
constexpr double kOtherUnit = 0.1;

absl::Status CheckNotBelowZero(const std::string& field, double value) {
  if (std::isfinite(value) && value >= 0) return absl::OkStatus();
  return Refuse(field, Rounded(value), "a finite number, at least 0");
}

absl::Status Check(const Points& points_mm, const std::vector<MeasuredLength>& lengths,
                   const SphereCheckOptions& options) {
  if (options.least_points < 5) return Refuse("least_points", std::to_string(options.least_points), "at least 5");
  if (static_cast<int>(points_mm.size()) < options.least_points)
    return Refuse("points_mm", std::to_string(points_mm.size()) + " of them",
                  "at least " + std::to_string(options.least_points));
  for (std::size_t i = 0; i < points_mm.size(); ++i)
    if (!points_mm[i].allFinite()) return Refuse("points_mm[" + std::to_string(i) + "]", "not finite", "a point");
  if (!std::isfinite(options.diameter_mm) || options.diameter_mm <= 0)
    return Refuse("diameter_mm", Rounded(options.diameter_mm), "> 0");
  for (const auto& [field, value] :
       {std::pair{"diameter_standard_uncertainty_um", options.diameter_standard_uncertainty_mm},
        {"sphere_form_um", options.sphere_form_mm},
        {"form_mpe_um", options.form_mpe_mm},
        {"size_mpe_um", options.size_mpe_mm},
        {"length_mpe_um", options.length_mpe_mm},
        {"length_mpe_divisor", options.length_mpe_divisor}})
    if (absl::Status s = CheckNotBelowZero(field, value); !s.ok()) return s;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const std::string field = "lengths[" + std::to_string(i) + "]";
    const MeasuredLength& l = lengths[i];
    if (!std::isfinite(l.calibrated_mm) || l.calibrated_mm <= 0)
      return Refuse(field + ".calibrated_mm", Rounded(l.calibrated_mm), "> 0");
    if (absl::Status s =
            CheckNotBelowZero(field + ".calibrated_standard_uncertainty_um", l.calibrated_standard_uncertainty_mm);
        !s.ok())
      return s;
    if (!std::isfinite(l.measured_mm) || std::abs(l.measured_mm / l.calibrated_mm - 1) > kOtherUnit)
      return Refuse(field + ".measured_mm", Rounded(l.measured_mm),
                    "about " + Rounded(l.calibrated_mm) + " (both in millimetres)");
  }
  return absl::OkStatus();
}

CheckedError Judge(const std::string& quantity, double error_mm, double standard_uncertainty_mm, double mpe_mm) {
  return {quantity, error_mm, standard_uncertainty_mm, mpe_mm, JudgeAgainst(mpe_mm, error_mm, standard_uncertainty_mm)};
}

StudyVerdict WorstOf(const std::vector<CheckedError>& errors) {
  StudyVerdict worst = StudyVerdict::kReported;
  for (const CheckedError& e : errors) {
    if (e.verdict == StudyVerdict::kRejected) return e.verdict;
    if (e.verdict == StudyVerdict::kUndecidable || worst == StudyVerdict::kReported) worst = e.verdict;
  }
  return worst;
}

}  // namespace

absl::StatusOr<SphereCheck> CheckSphere(const Points& points_mm, const std::vector<MeasuredLength>& lengths,
                                        const SphereCheckOptions& options) {
  if (absl::Status s = Check(points_mm, lengths, options); !s.ok()) return s;
  const auto n = static_cast<Eigen::Index>(points_mm.size());
  // About the points' middle: |p|^2 = 2 c . p + (r^2 - |c|^2) starts the geometric fit.
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points_mm) middle += p / static_cast<double>(n);
  Eigen::MatrixX4d rows(n, 4);
  Eigen::VectorXd right(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d p = points_mm[i] - middle;
    rows.row(i) << 2 * p.transpose(), 1;
    right(i) = p.squaredNorm();
  }
  const Eigen::Vector4d start = LeastSquares(rows, right);
  Eigen::Vector3d centre = start.head<3>();
  double radius = std::sqrt(std::max(0.0, start(3) + centre.squaredNorm()));
  Eigen::VectorXd residual(n);
  Eigen::MatrixX4d jacobian(n, 4);
  bool settled = false;
  for (int iteration = 0; iteration < kMostIterations && !settled; ++iteration) {
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Vector3d d = points_mm[i] - middle - centre;
      residual(i) = d.norm() - radius;
      jacobian.row(i) << -d.normalized().transpose(), -1;
    }
    const Eigen::Vector4d step = LeastSquares(jacobian, -residual);
    centre += step.head<3>();
    radius += step(3);
    settled = step.norm() < 1e-12 * std::max(1.0, radius);
  }
  const Eigen::Matrix4d normal = jacobian.transpose() * jacobian;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(normal);
  if (!settled || !(eigen.eigenvalues()(0) > 1e-6 * eigen.eigenvalues()(3)))
    return absl::FailedPreconditionError(
        "points_mm: they do not determine a sphere, want points spread over half of it");
  if (std::abs(2 * radius / options.diameter_mm - 1) > kOtherUnit)
    return Refuse("diameter_mm", Rounded(options.diameter_mm) + " with points on a sphere of " + Rounded(2 * radius),
                  "both in millimetres, of the same sphere");

  SphereCheck check;
  check.centre_mm = middle + centre;
  check.diameter_mm = 2 * radius;
  const double variance = residual.squaredNorm() / static_cast<double>(n - 4);
  const Eigen::Matrix4d covariance = variance * normal.inverse();
  check.centre_covariance_mm2 = covariance.topLeftCorner<3, 3>();
  check.diameter_standard_uncertainty_mm = 2 * std::sqrt(covariance(3, 3));
  check.standard_deviation_mm = std::sqrt(variance);
  // ISO/TS 23165: the sphere's own form is part of the range that was probed, at most half of it on each side.
  check.errors.push_back(
      Judge("form", residual.maxCoeff() - residual.minCoeff(), options.sphere_form_mm / 2, options.form_mpe_mm));
  check.errors.push_back(
      Judge("size", 2 * radius - options.diameter_mm, options.diameter_standard_uncertainty_mm, options.size_mpe_mm));
  for (const MeasuredLength& l : lengths) {
    const bool stated = options.length_mpe_mm > 0 || options.length_mpe_divisor > 0;
    const double growing = options.length_mpe_divisor > 0 ? l.calibrated_mm / options.length_mpe_divisor * 1e-3 : 0;
    check.errors.push_back(Judge(l.standard, l.measured_mm - l.calibrated_mm, l.calibrated_standard_uncertainty_mm,
                                 stated ? options.length_mpe_mm + growing : 0));
  }
  check.verdict = WorstOf(check.errors);
  return check;
}

}  // namespace sixpoint::metrology
