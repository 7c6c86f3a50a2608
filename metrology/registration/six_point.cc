#include "metrology/registration/six_point.h"

#include <absl/status/status.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "metrology/linear_algebra/inverse.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/parallel/loops.h"
#include "metrology/registration/gap_pull.h"
#include "metrology/registration/local_height.h"
#include "metrology/statistics/standard_deviation.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kDatumOffCadMm = 0.02;  // a datum's distance from the CAD
constexpr int kNormalsPassCount = 3;     // the pose moves under the local fits by little: this is ample

absl::Status Check(const Surface& surface, const std::vector<DatumPoint>& datums) {
  if (datums.size() != 6) return Refuse("part.six_points", std::to_string(datums.size()) + " points", "6");
  for (const DatumPoint& datum : datums) {
    const std::string field = "part.six_points[" + datum.name + "]";
    if (!datum.point_mm.allFinite() || !(std::abs(datum.normal.norm() - 1) < 1e-6))
      return Refuse(field, "not finite or no unit normal", "a point and its outward normal");
    const SurfacePoint on = surface.Closest(datum.point_mm);
    if (!(std::abs(on.signed_distance_mm) < kDatumOffCadMm))
      return Refuse(field + ".point_in_part_mm", Rounded(on.signed_distance_mm) + " mm off the CAD", "within 0.02");
    if (!(on.normal.dot(datum.normal) > 0.985))
      return Refuse(field + ".normal_in_part",
                    "cosine " + Rounded(on.normal.dot(datum.normal)) + " with the CAD's outward normal", "above 0.985");
  }
  return absl::OkStatus();
}

// How the six distances act on the pose; scaled changes of it: rotation times the radius of gyration, then translation.
struct Nest {
  std::array<LocalHeight, 6> heights;
  Matrix6d along_normals;  // of the six distances per change
  Matrix6d solver;         // change per distance
  Vector6d gap_sigmas_mm;  // of the CAD's surface at each
};

// The best fit's error is seen by the six distances and so partly (pairs) or wholly (normals) taken away again.
PlacedPose Placed(const Eigen::Isometry3d& zero_from_part, const Nest& nest, const PlacedPose& best_fit, double radius,
                  const MachineCalibration& calibration, FitEvidence* evidence) {
  Vector6d variances, scale = Vector6d::Ones();
  MappingSensitivity moved(6, best_fit.Sensitivity().cols());
  for (int i = 0; i < 6; ++i) {
    variances[i] = nest.heights[i].standard_uncertainty_mm * nest.heights[i].standard_uncertainty_mm;
    moved.row(i) = nest.heights[i].sensitivity;
  }
  scale.head<3>().setConstant(radius);
  const Vector6d unscale = scale.cwiseInverse();
  const Matrix6d kept = Matrix6d::Identity() - nest.solver * nest.along_normals;
  const Matrix6d before = scale.asDiagonal() * best_fit.noise_covariance.values * scale.asDiagonal();
  const Matrix6d noise =
      kept * before * kept.transpose() + nest.solver * variances.asDiagonal() * nest.solver.transpose();
  evidence->weakest_standard_uncertainty_mm =
      StandardDeviation(evidence->weakest_direction.dot(noise * evidence->weakest_direction));
  PlacedPose placed(
      zero_from_part, best_fit.covariance.reference_mm, unscale.asDiagonal() * noise * unscale.asDiagonal(),
      unscale.asDiagonal() * (kept * (scale.asDiagonal() * best_fit.Sensitivity()) + nest.solver * moved), calibration);
  const auto kept_of = [&](const char* name) {
    Eigen::Matrix<double, 6, Eigen::Dynamic> of(6, 0);
    for (const ErrorSource& source : best_fit.sources)
      if (source.name == name) of = unscale.asDiagonal() * (kept * (scale.asDiagonal() * source.pose_per_sigma));
    return of;
  };
  placed.AddSource(kFormDeviation, kept_of(kFormDeviation));
  // A datum near a gap of the CAD is off with it, beside what the best fit took of gaps.
  Eigen::Matrix<double, 6, Eigen::Dynamic> gaps = kept_of(kCadGap);
  gaps.conservativeResize(Eigen::NoChange, gaps.cols() + 6);
  gaps.rightCols<6>() = unscale.asDiagonal() * (nest.solver * nest.gap_sigmas_mm.asDiagonal());
  placed.AddSource(kCadGap, gaps);
  return placed;
}

std::string DegenerateNest(double condition_number, double limit) {
  char text[96];
  std::snprintf(text, sizeof text, "the six points do not locate the part: condition number %.3g, want below %.3g",
                condition_number, limit);
  return text;
}

}  // namespace

absl::StatusOr<PoseFit> FitSixPoints(const Surface& surface, const std::vector<ScanPortion>& portions,
                                     const std::vector<DatumPoint>& datums, const PoseFit& best_fit,
                                     SixPointVariant variant, const MachineCalibration& calibration,
                                     const FitOptions& options) {
  if (const absl::Status status = Check(surface, datums); !status.ok()) return status;
  if (const absl::Status status = CheckCovariances(calibration); !status.ok()) return status;
  if (!best_fit.placed) return best_fit;
  const Vector3d reference = best_fit.placed->covariance.reference_mm;
  const double radius = surface.radius_of_gyration_mm();
  const bool by_normals = variant == SixPointVariant::kNormals;
  PoseFit fit{Outcome::kNotConverged, std::nullopt, best_fit.evidence};
  fit.evidence.datums.resize(6);
  Eigen::Isometry3d zero_from_part = best_fit.placed->zero_from_part;
  Nest nest;
  for (int pass = 0; pass < (by_normals ? kNormalsPassCount : 1); ++pass) {
    if (options.keep_going && !options.keep_going()) return absl::CancelledError("registration: stopped by its caller");
    fit.evidence.stopped_at = zero_from_part;
    Vector6d distances;
    Matrix6d pairs = Matrix6d::Zero(), pulls;
    ForEach(6, options.thread_count, [&](std::size_t i) {
      nest.heights[i] = HeightAt(surface, portions, datums[i].point_mm, datums[i].normal, zero_from_part, calibration,
                                 1e-3 * options.model_error_um);
    });
    for (int i = 0; i < 6; ++i) {
      const LocalHeight& height = nest.heights[i];
      nest.gap_sigmas_mm[i] = GapUncertainty(surface.GapNear(datums[i].point_mm));
      Eigen::Matrix<double, 3, 6> moves = PointJacobian(zero_from_part * datums[i].point_mm, reference);
      moves.leftCols<3>() /= radius;
      nest.along_normals.row(i) = height.normal.transpose() * moves;
      pairs += moves.transpose() * moves;
      pulls.col(i) = moves.transpose() * height.normal;
      distances[i] = height.height_mm;
      if (pass == 0)
        fit.evidence.datums[i] = {datums[i].name, height.height_mm, height.standard_uncertainty_mm, height.point_count};
      if (height.point_count < kLeastLocalPoints) {
        fit.Withdraw(Outcome::kTooLittleOverlap, "datum " + datums[i].name + ": " + std::to_string(height.point_count) +
                                                     " scan points within 1 mm, want at least " +
                                                     std::to_string(kLeastLocalPoints));
        return fit;
      }
    }
    const EigenSystem6 eigen =
        EigenSystemOf(by_normals ? Matrix6d(nest.along_normals.transpose() * nest.along_normals) : pairs);
    fit.evidence.condition_number = ConditionNumberOf(eigen.values);
    fit.evidence.weakest_direction = eigen.vectors.col(0);
    if (!(fit.evidence.condition_number < options.condition_limit)) {
      fit.Withdraw(Outcome::kNotDetermined, DegenerateNest(fit.evidence.condition_number, options.condition_limit));
      return fit;
    }
    nest.solver = by_normals ? Inverse(nest.along_normals) : Matrix6d(Inverse(pairs) * pulls);
    Vector6d change = nest.solver * distances;
    change.head<3>() /= radius;
    zero_from_part = Perturbed(zero_from_part, change, reference);
    zero_from_part.linear() = Eigen::Quaterniond(zero_from_part.linear()).normalized().toRotationMatrix();
    fit.evidence.iteration_count += 1;
  }
  fit.outcome = Outcome::kConverged;
  fit.evidence.stopped_at = zero_from_part;
  fit.placed = Placed(zero_from_part, nest, *best_fit.placed, radius, calibration, &fit.evidence);
  return fit;
}

}  // namespace sixpoint::metrology
