#include <absl/status/status.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "metrology/registration/registration.h"
#include "metrology/registration/surface_residuals.h"
#include "metrology/statistics/ranks.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kLocalRadiusMm = 1;    // of the scan's patch around a datum
constexpr double kLocalHeightMm = 0.8;  // of the patch, either way along the normal
constexpr double kOnSurfaceMm = 0.02;   // a datum's distance from the CAD
constexpr std::int64_t kLeastLocalPoints = 30;
constexpr int kNormalsPassCount = 3;    // the pose moves under the local fits by little: this is ample
constexpr std::size_t kBatchSize = 64;  // neighbours whose errors may be correlated; fewer where that makes few batches
constexpr std::size_t kLeastBatches = 24;
constexpr int kCurveCount = 6;  // terms of a quadratic in two variables
using Curve = Eigen::Matrix<double, kCurveCount, 1>;

// The scanned surface's height over the CAD at a datum.
struct LocalHeight {
  double height_mm = 0;
  double standard_uncertainty_mm = 0;
  std::int64_t point_count = 0;
  Vector3d normal;  // of the CAD, at zero
  Eigen::Matrix<double, 1, kCalibrationParameterCount> sensitivity =
      Eigen::Matrix<double, 1, kCalibrationParameterCount>::Zero();
};

struct LocalPoint {
  Curve terms;
  double height_mm;
  std::uint32_t portion, index;
};

Curve Terms(double u, double v) {
  Curve terms;
  terms << 1, u, v, u * u, u * v, v * v;
  return terms;
}

// Robust quadratic fit of the deviation from the CAD around the datum; its value and uncertainty at the datum itself.
LocalHeight HeightAt(const Surface& surface, const std::vector<ScanPortion>& portions, const DatumPoint& datum,
                     const Eigen::Isometry3d& zero_from_part, const MachineCalibration& calibration, double floor_mm) {
  const Eigen::Isometry3d part_from_zero = zero_from_part.inverse(Eigen::Isometry);
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(datum.normal);
  LocalHeight local;
  local.normal = zero_from_part.linear() * datum.normal;
  std::vector<LocalPoint> points;
  bool dense = false;
  for (const ScanPortion& portion : portions) dense = dense || !portion.dense_zero_mm.empty();
  for (std::uint32_t p = 0; p < portions.size(); ++p) {
    const ScanPortion& portion = portions[p];
    const std::size_t count = dense ? portion.dense_zero_mm.size() : portion.sensor.size();
    std::uint32_t hint = Surface::kNoTriangle;
    for (std::uint32_t i = 0; i < count; ++i) {
      const Vector3d q = part_from_zero * (dense ? portion.dense_zero_mm[i] : portion.zero_mm(i));
      const Vector3d offset = q - datum.point_mm;
      if (offset.squaredNorm() > kLocalRadiusMm * kLocalRadiusMm + kLocalHeightMm * kLocalHeightMm) continue;
      const double along = offset.dot(datum.normal);
      const Eigen::Vector2d uv = across.transpose() * offset / kLocalRadiusMm;
      if (std::abs(along) > kLocalHeightMm || uv.squaredNorm() > 1) continue;
      const SurfacePoint found = surface.ClosestWithin(q, kLocalHeightMm, hint);
      if (!std::isfinite(found.signed_distance_mm)) continue;
      hint = found.triangle;
      if (found.feature != SurfaceFeature::kFace || found.normal.dot(datum.normal) < 0.8) continue;
      points.push_back({Terms(uv.x(), uv.y()), found.signed_distance_mm, p, i});
    }
  }
  local.point_count = static_cast<std::int64_t>(points.size());
  if (local.point_count < kLeastLocalPoints) return local;

  std::vector<double> residuals(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) residuals[i] = points[i].height_mm;
  Curve curve = Curve::Zero();
  curve[0] = UpperMedian(residuals);
  Eigen::Matrix<double, kCurveCount, kCurveCount> matrix;
  double width = 0;
  for (int iteration = 0; iteration < 12; ++iteration) {
    for (std::size_t i = 0; i < points.size(); ++i) residuals[i] = points[i].height_mm - points[i].terms.dot(curve);
    width = kTukeyWidth * std::max(floor_mm, RobustSigma(residuals));
    matrix.setZero();
    Curve right = Curve::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double weight = TukeyWeight(residuals[i], width);
      matrix += weight * points[i].terms * points[i].terms.transpose();
      right += weight * points[i].height_mm * points[i].terms;
    }
    const Curve next = matrix.completeOrthogonalDecomposition().solve(right);
    const double moved = (next - curve).norm();
    curve = next;
    if (moved < 1e-9) break;
  }
  // Row 0 of the inverse: how each point's height acts on the height at the datum.
  const Curve influence = matrix.completeOrthogonalDecomposition().pseudoInverse().row(0);
  // The fit takes the sum of all scores to zero and with six terms most of what a few batches would show.
  const std::size_t batch_size = std::clamp<std::size_t>(points.size() / kLeastBatches, 1, kBatchSize);
  double variance = 0, score = 0, batches = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double residual = points[i].height_mm - points[i].terms.dot(curve);
    const double share = TukeyWeight(residual, width) * influence.dot(points[i].terms);
    score += share * residual;
    if ((i + 1) % batch_size == 0 || i + 1 == points.size()) {
      variance += score * score;
      score = 0;
      ++batches;
    }
    const ScanPortion& portion = portions[points[i].portion];
    const std::uint32_t k = points[i].index;
    const Vector3d sensor = dense ? portion.dense_sensor_mm[k] : portion.sensor[k];
    const Vector3d zero = dense ? portion.dense_zero_mm[k] : portion.zero_mm(k);
    local.sensitivity += share * (local.normal.transpose() *
                                  ZeroPointSensitivity(sensor, zero, portion.a_rad, portion.b_rad, calibration));
  }
  local.height_mm = curve[0];
  local.standard_uncertainty_mm = std::sqrt(variance * batches / (batches - kCurveCount));
  return local;
}

absl::Status Check(const Surface& surface, const std::vector<DatumPoint>& datums) {
  if (datums.size() != 6) return Refuse("part.six_points", std::to_string(datums.size()) + " points", "6");
  for (const DatumPoint& datum : datums) {
    const std::string field = "part.six_points[" + datum.name + "]";
    if (!datum.point_mm.allFinite() || !(std::abs(datum.normal.norm() - 1) < 1e-6))
      return Refuse(field, "not finite or no unit normal", "a point and its outward normal");
    const SurfacePoint on = surface.Closest(datum.point_mm);
    if (!(std::abs(on.signed_distance_mm) < kOnSurfaceMm))
      return Refuse(field + ".point_in_part_mm", Rounded(on.signed_distance_mm) + " mm off the CAD", "within 0.02");
    if (!(on.normal.dot(datum.normal) > 0.985))
      return Refuse(field + ".normal_in_part",
                    "cosine " + Rounded(on.normal.dot(datum.normal)) + " with the CAD's outward normal", "above 0.985");
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PoseFit> FitSixPoints(const Surface& surface, const std::vector<ScanPortion>& portions,
                                     const std::vector<DatumPoint>& datums, const PoseFit& best_fit,
                                     SixPointVariant variant, const MachineCalibration& calibration,
                                     const FitOptions& options) {
  if (const absl::Status status = Check(surface, datums); !status.ok()) return status;
  PoseFit fit = best_fit;
  if (best_fit.outcome != Outcome::kConverged) return fit;
  const Vector3d reference = best_fit.covariance.reference_mm;
  const double radius = surface.radius_of_gyration_mm();
  fit.evidence.datums.resize(6);
  std::array<LocalHeight, 6> heights;
  // Scaled changes of the pose: rotation times the radius of gyration, then translation.
  Matrix6d along_normals;  // of the six distances per change
  Matrix6d solver;         // change per distance
  const int passes = variant == SixPointVariant::kNormals ? kNormalsPassCount : 1;
  for (int pass = 0; pass < passes; ++pass) {
    if (options.keep_going && !options.keep_going()) return absl::CancelledError("registration: stopped by its caller");
    Vector6d distances;
    Matrix6d pairs = Matrix6d::Zero(), pulls;
    for (int i = 0; i < 6; ++i) {
      heights[i] =
          HeightAt(surface, portions, datums[i], fit.zero_from_part, calibration, 1e-3 * options.model_error_um);
      Eigen::Matrix<double, 3, 6> moves = PointJacobian(fit.zero_from_part * datums[i].point_mm, reference);
      moves.leftCols<3>() /= radius;
      along_normals.row(i) = heights[i].normal.transpose() * moves;
      pairs += moves.transpose() * moves;
      pulls.col(i) = moves.transpose() * heights[i].normal;
      distances[i] = heights[i].height_mm;
      if (pass == 0)
        fit.evidence.datums[i] = {datums[i].name, heights[i].height_mm, heights[i].standard_uncertainty_mm,
                                  heights[i].point_count};
      if (heights[i].point_count < kLeastLocalPoints) {
        fit.outcome = Outcome::kTooLittleOverlap;
        fit.evidence.remark = "datum " + datums[i].name + ": " + std::to_string(heights[i].point_count) +
                              " scan points within 1 mm, want at least " + std::to_string(kLeastLocalPoints);
        return fit;
      }
    }
    const Matrix6d matrix =
        variant == SixPointVariant::kNormals ? Matrix6d(along_normals.transpose() * along_normals) : pairs;
    fit.evidence.condition_number = ConditionNumber(matrix, &fit.evidence.weakest_direction);
    if (!(fit.evidence.condition_number < options.condition_limit)) {
      char text[96];
      std::snprintf(text, sizeof text, "the six points do not locate the part: condition number %.3g, want below %.3g",
                    fit.evidence.condition_number, options.condition_limit);
      fit.outcome = Outcome::kNotDetermined;
      fit.evidence.remark = text;
      return fit;
    }
    solver =
        variant == SixPointVariant::kNormals ? Matrix6d(along_normals.inverse()) : Matrix6d(pairs.inverse() * pulls);
    Vector6d change = solver * distances;
    change.head<3>() /= radius;
    fit.zero_from_part = Perturbed(fit.zero_from_part, change, reference);
    fit.zero_from_part.linear() = Eigen::Quaterniond(fit.zero_from_part.linear()).normalized().toRotationMatrix();
    fit.evidence.iteration_count += 1;
  }
  // The best fit's error is seen by the six distances and so partly (pairs) or wholly (normals) taken away again.
  Vector6d variances, scale = Vector6d::Ones();
  Eigen::Matrix<double, 6, kCalibrationParameterCount> moved;
  for (int i = 0; i < 6; ++i) {
    variances[i] = heights[i].standard_uncertainty_mm * heights[i].standard_uncertainty_mm;
    moved.row(i) = heights[i].sensitivity;
  }
  scale.head<3>().setConstant(radius);
  const Vector6d unscale = scale.cwiseInverse();
  const Matrix6d kept = Matrix6d::Identity() - solver * along_normals;
  const Matrix6d before = scale.asDiagonal() * best_fit.noise_covariance.values * scale.asDiagonal();
  const Matrix6d noise = kept * before * kept.transpose() + solver * variances.asDiagonal() * solver.transpose();
  fit.evidence.weakest_standard_uncertainty_mm =
      std::sqrt(std::max(0.0, fit.evidence.weakest_direction.dot(noise * fit.evidence.weakest_direction)));
  fit.noise_covariance.values = unscale.asDiagonal() * noise * unscale.asDiagonal();
  fit.calibration_sensitivity =
      unscale.asDiagonal() * (kept * (scale.asDiagonal() * best_fit.calibration_sensitivity) + solver * moved);
  fit.covariance.values = fit.noise_covariance.values + fit.calibration_sensitivity * CovarianceOf(calibration) *
                                                            fit.calibration_sensitivity.transpose();
  return fit;
}

}  // namespace sixpoint::metrology
