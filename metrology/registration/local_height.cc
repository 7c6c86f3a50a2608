#include "metrology/registration/local_height.h"

#include <algorithm>
#include <cmath>

#include "metrology/linear_algebra/pseudo_inverse.h"
#include "metrology/registration/surface_residuals.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kLocalRadiusMm = 1;    // of the scan's patch around the point
constexpr double kLocalHeightMm = 0.8;  // of the patch, either way along the normal
constexpr double kReachSquared = kLocalRadiusMm * kLocalRadiusMm + kLocalHeightMm * kLocalHeightMm;
constexpr std::size_t kBatchSize = 64;  // neighbours whose errors may be correlated; fewer where that makes few batches
constexpr std::size_t kLeastBatches = 24;
constexpr int kCurveCount = 6;  // terms of a quadratic in two variables
using Curve = Eigen::Matrix<double, kCurveCount, 1>;

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

// All that lies on the face about the datum, in the order of the portions.
std::vector<LocalPoint> PointsAbout(const Surface& surface, const std::vector<ScanPortion>& portions,
                                    const Vector3d& point_mm, const Vector3d& normal,
                                    const Eigen::Isometry3d& zero_from_part, bool dense) {
  const Eigen::Isometry3d part_from_zero = zero_from_part.inverse(Eigen::Isometry);
  const Vector3d in_zero_mm = zero_from_part * point_mm;
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(normal);
  std::vector<LocalPoint> points;
  for (std::uint32_t p = 0; p < portions.size(); ++p) {
    const ScanPortion& portion = portions[p];
    const std::size_t count = dense ? portion.dense_zero_mm.size() : portion.sensor.size();
    std::uint32_t hint = Surface::kNoTriangle;
    for (std::uint32_t i = 0; i < count; ++i) {
      const Vector3d zero = dense ? portion.dense_zero_mm[i] : portion.zero_mm(i);
      // Most are another datum's: told apart before they are mapped, and by what is exact after.
      if ((zero - in_zero_mm).squaredNorm() > 1.001 * kReachSquared) continue;
      const Vector3d q = part_from_zero * zero;
      const Vector3d offset = q - point_mm;
      if (offset.squaredNorm() > kReachSquared) continue;
      const double along = offset.dot(normal);
      const Eigen::Vector2d uv = across.transpose() * offset / kLocalRadiusMm;
      if (std::abs(along) > kLocalHeightMm || uv.squaredNorm() > 1) continue;
      const SurfacePoint found = surface.ClosestWithin(q, kLocalHeightMm, hint);
      if (!std::isfinite(found.signed_distance_mm)) continue;
      hint = found.triangle;
      if (found.feature != SurfaceFeature::kFace || found.normal.dot(normal) < 0.8) continue;
      points.push_back({Terms(uv.x(), uv.y()), found.signed_distance_mm, p, i});
    }
  }
  return points;
}

}  // namespace

LocalHeight HeightAt(const Surface& surface, const std::vector<ScanPortion>& portions, const Vector3d& point_mm,
                     const Vector3d& normal, const Eigen::Isometry3d& zero_from_part,
                     const MachineCalibration& calibration, double floor_mm) {
  LocalHeight local;
  local.normal = zero_from_part.linear() * normal;
  local.sensitivity.setZero(1, MappingParameterCount(portions.size()));
  const bool dense = std::any_of(portions.begin(), portions.end(),
                                 [](const ScanPortion& portion) { return !portion.dense_zero_mm.empty(); });
  const std::vector<LocalPoint> points = PointsAbout(surface, portions, point_mm, normal, zero_from_part, dense);
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
    const Curve next = ShortestSolution(matrix, right);
    const double moved = (next - curve).norm();
    curve = next;
    if (moved < 1e-9) break;
  }
  // Row 0 of the inverse: how each point's height acts on the height at the datum.
  const Curve influence = PseudoInverse(matrix).row(0);
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
    AddSensitivity(Eigen::VectorXd::Constant(1, share), local.normal, {points[i].portion, sensor, zero}, portions,
                   calibration, &local.sensitivity);
  }
  local.height_mm = curve[0];
  local.standard_uncertainty_mm = std::sqrt(variance * batches / (batches - kCurveCount));
  return local;
}

}  // namespace sixpoint::metrology
