#include "metrology/registration/best_fit.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <utility>

#include "metrology/linear_algebra/inverse.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/registration/angle_influence.h"
#include "metrology/registration/coarse_start.h"
#include "metrology/registration/fit_samples.h"
#include "metrology/registration/form_deviation.h"
#include "metrology/registration/gap_pull.h"
#include "metrology/registration/patch_evidence.h"
#include "metrology/registration/patch_fit.h"
#include "metrology/registration/patch_sums.h"
#include "metrology/registration/surface_residuals.h"
#include "metrology/statistics/ranks.h"
#include "metrology/statistics/standard_deviation.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::size_t kFirstCount = 2'000;    // points that follow the pose from its start
constexpr std::size_t kCoarseCount = 10'000;  // and that bring it near
constexpr int kCoarseSteps = 12;
constexpr double kNarrowEnough = 1.05;        // the loss, by its final width
constexpr std::size_t kManyPoints = 200'000;  // from here on it pays to prepare the surface for them
constexpr double kNearlyAll = 0.995;          // of the points within reach of the start
constexpr double kAnnealing = 0.65;           // the loss narrows by this, once the pose rests at its present width
constexpr double kStepLimitMm = 3;            // of one step
constexpr double kRestedInSigmas =
    0.25;  // step after which the pose rests at a width, in standard deviations of a point
// The loss keeps at least this part of the points within reach. In Gaussian noise alone that quantile of |residual| is
// 0.524 standard deviations; a little less than its inverse, so that up to a third of the points may be foreign.
constexpr double kNearestPoints = 0.4;
constexpr double kNearestToSigma = 0.6 / 0.524;
constexpr double kPointWidth = 6;  // of the loss over all points, in standard deviations: 98 % efficient
constexpr int kPassLimit = 12;
// A pose nearer than this needs no second reading of the points: on a radius of 0.5 mm it changes a distance by 4 nm.
constexpr double kNearPoseMm = 2e-3;
constexpr double kNarrower = 0.6;          // of the loss's width, for which the points are read again
constexpr double kHeldInSigmas = 10;       // of a point; a direction known no better is not held
constexpr double kLeastInformation = 0.5;  // kept along the weakest direction, below which it is said

std::string Um(double mm) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g um", 1e3 * mm);
  return text;
}

// The directions in which the points do not hold the part.
std::string FreeDirections(const Matrix6d& matrix, double condition_limit) {
  const EigenSystem6 eigen = EigenSystemOf(matrix);
  std::string listed;
  int count = 0;
  for (int k = 0; k < 6; ++k) {
    if (eigen.values[k] * condition_limit * condition_limit > eigen.values[5]) break;
    const Vector6d v = eigen.vectors.col(k);
    char text[96];
    std::snprintf(text, sizeof text, "%s(%.2f %.2f %.2f, %.2f %.2f %.2f)", count++ > 0 ? ", " : "", v[0], v[1], v[2],
                  v[3], v[4], v[5]);
    listed += text;
  }
  return "the points leave " + std::to_string(count) +
         " directions free (turn about x, y, z by the radius of gyration, shift along x, y, z): " + listed;
}

class BestFit {
 public:
  BestFit(const Surface& surface, const std::vector<ScanPortion>& portions, const Isometry3d& nominal,
          const MachineCalibration& calibration, const FitOptions& options)
      : surface_(surface),
        portions_(portions),
        calibration_(calibration),
        options_(options),
        reference_mm_(nominal * surface.centroid_mm()),
        radius_mm_(surface.radius_of_gyration_mm()),
        coarse_(surface, SamplesOf(portions, nominal, options, kFirstCount), reference_mm_, options.thread_count),
        pose_(nominal) {
    patch_options_.patch_mm = PatchWidthMm(radius_mm_);
    patch_options_.condition_limit = options.condition_limit;
    patch_options_.free.resize(6, std::count(options.free.begin(), options.free.end(), true));
    for (int k = 0, column = 0; k < 6; ++k)
      if (options.free[static_cast<std::size_t>(k)]) patch_options_.free.col(column++) = Vector6d::Unit(k);
  }

  absl::StatusOr<PoseFit> Run() {
    if (coarse_.samples().size() < 6)
      return Refuse(
          options_.regions_in.empty() ? "scans" : "regions",
          std::to_string(coarse_.samples().size()) + (options_.regions_in.empty() ? " points" : " points in them"),
          "at least 6");
    if (const absl::Status status = FindPose(); !status.ok()) return status;
    bool converged = false;
    double width = 0;
    for (int pass = 0; pass < kPassLimit && !converged; ++pass) {
      // As wide as the noise, and as what the pose may still be off where few points hold it.
      width = kPointWidth * sigma_mm_ + 3 * std::sqrt(GreatestVariance());
      auto sums = SumPatches(surface_, portions_, pose_, {width, patch_options_.patch_mm}, options_);
      if (!sums.ok()) return sums.status();
      sums_ = *std::move(sums);
      patches_ = FitPatches(sums_, patch_options_);
      pose_ = MovedInPart(patches_.change);
      last_step_mm_ = patches_.change.norm();
      patch_options_.start_covariance = patches_.covariance;
      sigma_mm_ = std::min(sigma_mm_, std::max(std::hypot(patches_.noise_sigma_mm, patches_.model_sigma_mm),
                                               1e-3 * options_.model_error_um));
      CountIteration();
      const double next = kPointWidth * sigma_mm_ + 3 * std::sqrt(GreatestVariance());
      converged = last_step_mm_ < kNearPoseMm && next > kNarrower * width;
    }
    return Report(converged, width);
  }

 private:
  absl::Status GoOn() const {
    if (options_.keep_going && !options_.keep_going())
      return absl::CancelledError("registration: stopped by its caller");
    return absl::OkStatus();
  }

  void CountIteration() {
    ++iteration_count_;
    if (options_.on_iteration) options_.on_iteration(iteration_count_);
  }

  bool AllFree() const { return patch_options_.free.cols() == 6; }

  // zero_from_part after a scaled change in the part frame.
  Isometry3d MovedInPart(const Vector6d& scaled) const {
    Vector6d change = scaled;
    change.head<3>() /= radius_mm_;
    return Righted(pose_ * Perturbed(Isometry3d::Identity(), change, surface_.centroid_mm()));
  }
  static Isometry3d Righted(Isometry3d pose) {
    pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
    return pose;
  }

  // Of a scaled change at zero about reference_mm_, per scaled change in the part frame.
  Matrix6d ZeroFromPartChange() const {
    const Eigen::Matrix3d turn = pose_.linear();
    Matrix6d change = Matrix6d::Zero();
    change.topLeftCorner<3, 3>() = change.bottomRightCorner<3, 3>() = turn;
    change.bottomLeftCorner<3, 3>() = -Skew(reference_mm_ - pose_ * surface_.centroid_mm()) * turn / radius_mm_;
    return change;
  }

  // Of the weakest direction that the points hold at all, mm^2.
  double GreatestVariance() const {
    const EigenSystem6 eigen = EigenSystemOf(patch_options_.start_covariance);
    double greatest = 0;
    for (int k = 0; k < 6; ++k)
      if (eigen.values[k] < kHeldInSigmas * kHeldInSigmas * sigma_mm_ * sigma_mm_)
        greatest = std::max(greatest, eigen.values[k]);
    return greatest;
  }

  // Applies a scaled change at zero; returns its size. Directions that are not free do not change.
  double Move(const SurfaceResiduals& residuals, Vector6d change) {
    CountIteration();
    if (!AllFree()) {
      const Matrix6d to_zero = ZeroFromPartChange();
      const auto& free = patch_options_.free;
      change = to_zero * (free * (free.transpose() * Inverse(to_zero) * change));
    }
    const double size = change.norm();
    if (size > kStepLimitMm) change *= kStepLimitMm / size;
    pose_ = Righted(Perturbed(pose_, residuals.Unscaled(change), reference_mm_));
    return size;
  }

  // From a standard deviation down to the final one, the pose coming to rest at each width before the next.
  absl::Status Anneal(double sigma_mm, int step_limit) {
    const int limit = iteration_count_ + step_limit;
    while (iteration_count_ < limit) {
      if (const absl::Status status = GoOn(); !status.ok()) return status;
      const double width = kTukeyWidth * sigma_mm;
      coarse_.Search(pose_, std::min(1.5 * width + 0.01, 2 * options_.greatest_start_error_mm));
      const double step = Move(coarse_, coarse_.Minimise(Vector6d::Zero(), width, 4));
      if (step > kRestedInSigmas * sigma_mm) continue;
      const double final_sigma = FinalSigma(coarse_);
      if (sigma_mm <= kNarrowEnough * final_sigma) break;
      sigma_mm_ = sigma_mm = std::min(sigma_mm, std::max(final_sigma, kAnnealing * sigma_mm));
    }
    return absl::OkStatus();
  }

  // How narrow the loss may get: the noise; but where the part itself deviates nearly everywhere, as castings do, the
  // spread of the nearest points, or the fit would follow whichever patch happens to fit best.
  double FinalSigma(const SurfaceResiduals& residuals) const {
    std::vector<double> distances;
    distances.reserve(residuals.samples().size());
    for (const Sample& sample : residuals.samples())
      distances.push_back(sample.usable ? std::abs(sample.residual_mm) : std::numeric_limits<double>::infinity());
    const double nearest_mm =
        AtRank(static_cast<std::size_t>(kNearestPoints * static_cast<double>(distances.size())), &distances);
    return std::max(std::hypot(residuals.NeighbourNoise(), 1e-3 * options_.model_error_um),
                    kNearestToSigma * nearest_mm);
  }

  // Of the samples that are usable, in their order.
  std::vector<double> Distances() const {
    std::vector<double> distances;
    for (const Sample& sample : coarse_.samples())
      if (sample.usable) distances.push_back(std::abs(sample.residual_mm));
    return distances;
  }

  absl::Status FindPose() {
    coarse_.Search(pose_, options_.greatest_start_error_mm);
    std::vector<double> distances = Distances();
    if (options_.coarse_start) {
      auto found = FindCoarseStart(surface_, portions_, pose_, options_);
      if (!found.ok()) return found.status();
      pose_ = found->zero_from_part;
      ambiguous_ = found->remark;
      coarse_ = SurfaceResiduals(surface_, SamplesOf(portions_, pose_, options_, kFirstCount), reference_mm_,
                                 options_.thread_count);
      coarse_.Search(pose_, options_.greatest_start_error_mm);
      distances = Distances();
    }
    // Wide enough for the few that may alone hold a direction, as a tip does: they must not be foreign from the start.
    double start = 0.02;
    if (!distances.empty()) {
      const double far_mm =
          AtRank(static_cast<std::size_t>(kNearlyAll * static_cast<double>(distances.size())), &distances);
      start = std::clamp(0.5 * far_mm, start, options_.greatest_start_error_mm);
    }
    sigma_mm_ = start;
    if (const absl::Status status = Anneal(start, options_.iteration_limit); !status.ok()) return status;
    std::size_t total = 0;
    for (const ScanPortion& portion : portions_) total += portion.sensor.size();
    if (total > kFirstCount) {
      coarse_ = SurfaceResiduals(surface_, SamplesOf(portions_, pose_, options_, kCoarseCount), reference_mm_,
                                 options_.thread_count);
      if (const absl::Status status = Anneal(sigma_mm_, kCoarseSteps); !status.ok()) return status;
    }
    const Matrix6d matrix = coarse_.At(Vector6d::Zero(), kTukeyWidth * sigma_mm_).matrix;
    const Matrix6d from_zero = Inverse(ZeroFromPartChange());
    const Matrix6d held = matrix + 1e-12 * (1 + matrix.trace()) * Matrix6d::Identity();
    patch_options_.start_covariance = sigma_mm_ * sigma_mm_ * from_zero * Inverse(held) * from_zero.transpose();
    return absl::OkStatus();
  }

  absl::StatusOr<PoseFit> Report(bool converged, double width_mm);
  PlacedPose Placed(double width_mm);

  const Surface& surface_;
  const std::vector<ScanPortion>& portions_;
  const MachineCalibration& calibration_;
  const FitOptions& options_;
  const Vector3d reference_mm_;
  const double radius_mm_;
  SurfaceResiduals coarse_;
  Isometry3d pose_;
  double sigma_mm_ = 0;
  int iteration_count_ = 0;
  PatchFitOptions patch_options_;
  PatchSums sums_;
  PatchFit patches_;
  double last_step_mm_ = 0;
  std::string ambiguous_;
};

// Noise and model error: from the patches. Calibrations: A^-1 sum psi' J (n . dp/dtheta) over some thousands of points,
// with the weights that their patches have.
PlacedPose BestFit::Placed(double width_mm) {
  std::map<std::pair<std::uint32_t, PatchKey>, double> slopes;
  for (std::size_t k = 0; k < sums_.patches.size(); ++k)
    slopes[{sums_.patches[k].portion, sums_.patches[k].key}] = patches_.slopes[k];
  coarse_.Search(pose_, width_mm);
  const Isometry3d part_from_zero = pose_.inverse(Eigen::Isometry);
  Matrix6d a = Matrix6d::Zero();
  FormPull form(MappingCovariance(calibration_, portions_));
  GapPull gap;
  MappingSensitivity moved = MappingSensitivity::Zero(6, MappingParameterCount(portions_.size()));
  for (const Sample& sample : coarse_.samples()) {
    const double u = sample.residual_mm / width_mm;
    if (!sample.usable || !(u * u < 1)) continue;
    const Vector3d normal = part_from_zero.linear() * sample.normal;
    const Vector3d from_centroid =
        part_from_zero * sample.zero_mm - sample.residual_mm * normal - surface_.centroid_mm();
    const auto slope = slopes.find({sample.portion, PatchKeyOf(from_centroid, normal, patch_options_.patch_mm)});
    if (slope == slopes.end()) continue;
    const Vector6d row = PartRow(from_centroid, normal, radius_mm_);
    const double weight = slope->second * (1 - u * u) * (1 - 5 * u * u) *
                          (options_.scan_weights.empty() ? 1 : options_.scan_weights[sample.portion]);
    a += weight * row * row.transpose();
    const MappedPoint mapped{sample.portion, portions_[sample.portion].sensor[sample.index], sample.zero_mm};
    MappingSensitivity by_mapping = MappingSensitivity::Zero(1, moved.cols());
    AddSensitivity(Eigen::VectorXd::Ones(1), sample.normal, mapped, portions_, calibration_, &by_mapping);
    form.Add({from_centroid, normal, row, weight, by_mapping});
    gap.Add(surface_.GapNear(from_centroid + surface_.centroid_mm()), weight, row, from_centroid, normal);
    moved += weight * row * by_mapping;
  }
  const Matrix6d inverse = InverseIn(a, patch_options_.free);
  // From scaled changes in the part frame to changes at zero about the part's centroid.
  Matrix6d to_zero = Matrix6d::Zero();
  to_zero.topLeftCorner<3, 3>() = pose_.linear() / radius_mm_;
  to_zero.bottomRightCorner<3, 3>() = pose_.linear();
  PlacedPose placed(pose_, pose_ * surface_.centroid_mm(), to_zero * patches_.covariance * to_zero.transpose(),
                    to_zero * (inverse * moved), calibration_);
  // What is held where the part is not pulls the free directions with it.
  const Matrix6d held = HeldUncertainty(options_, radius_mm_).asDiagonal();
  placed.AddSource(kHeldDirections, to_zero * (held - inverse * a * held));
  placed.AddSource(kFormDeviation,
                   to_zero * form.Root(inverse, patches_.model_sigma_mm, 1e-3 * options_.form_error_um));
  placed.AddSource(kCadGap, to_zero * gap.Root(inverse));
  return placed;
}

absl::StatusOr<PoseFit> BestFit::Report(bool converged, double width_mm) {
  PoseFit fit;
  FitEvidence& evidence = fit.evidence;
  DescribePatches(surface_, portions_, sums_, patches_, patch_options_.patch_mm, options_, &evidence);
  evidence.stopped_at = pose_;
  evidence.iteration_count = iteration_count_;
  evidence.residual_sigma_mm = sums_.residual_sigma_mm;
  evidence.noise_sigma_mm = patches_.noise_sigma_mm;
  evidence.model_sigma_mm = patches_.model_sigma_mm;
  evidence.patch_mm = patch_options_.patch_mm;
  evidence.correlation_widening = patches_.correlation_widening;
  evidence.information_kept = patches_.information_kept;
  evidence.last_step_mm = last_step_mm_;
  const auto& free = patch_options_.free;
  const EigenSystem eigen = EigenSystemOf(Restricted(patches_.normal, free));
  evidence.condition_number = ConditionNumberOf(eigen.values);
  const Vector6d weakest = free * eigen.vectors.col(0);
  evidence.weakest_direction << pose_.linear() * weakest.head<3>(), pose_.linear() * weakest.tail<3>();
  evidence.weakest_standard_uncertainty_mm = StandardDeviation(weakest.dot(patches_.covariance * weakest));

  if (evidence.overlap < options_.least_overlap || !(sigma_mm_ < options_.greatest_spread_mm)) {
    fit.outcome = Outcome::kTooLittleOverlap;
    evidence.remark = "of the points " + Percent(evidence.overlap) + " lie on the surface, within a spread of " +
                      Um(sigma_mm_) + "; want at least " + Percent(options_.least_overlap) + " within " +
                      Um(options_.greatest_spread_mm) + ": another blade, another side or no overlap";
    return fit;
  }
  if (!ambiguous_.empty()) {
    fit.outcome = Outcome::kNotDetermined;
    evidence.remark = ambiguous_;
    return fit;
  }
  if (!(evidence.condition_number < options_.condition_limit)) {
    fit.outcome = Outcome::kNotDetermined;
    Matrix6d turned = Matrix6d::Zero();
    turned.topLeftCorner<3, 3>() = turned.bottomRightCorner<3, 3>() = pose_.linear();
    evidence.remark = FreeDirections(turned * patches_.normal * turned.transpose(), options_.condition_limit);
    return fit;
  }
  if (!converged) {
    evidence.remark = "the pose still moves after " + std::to_string(iteration_count_) + " iterations";
    return fit;
  }
  fit.outcome = Outcome::kConverged;
  fit.placed = Placed(width_mm);
  evidence.weakest_standard_uncertainty_mm =
      WithFormAndGaps(*fit.placed, evidence.weakest_direction, radius_mm_, evidence.weakest_standard_uncertainty_mm);
  evidence.remark = StandingOff(evidence);
  if (evidence.information_kept < kLeastInformation)
    AddRemark("the loss threw out " + Percent(1 - evidence.information_kept) +
                  " of what the points say along the weakest direction: its uncertainty is that of the rest",
              &evidence);
  return fit;
}

}  // namespace

absl::StatusOr<PoseFit> FitToSurface(const Surface& surface, const std::vector<ScanPortion>& portions,
                                     const Isometry3d& zero_from_part_nominal, const MachineCalibration& calibration,
                                     const FitOptions& options) {
  if (const absl::Status status = CheckInputs(portions, zero_from_part_nominal, options); !status.ok()) return status;
  if (const absl::Status status = CheckCovariances(calibration); !status.ok()) return status;
  std::size_t count = 0;
  for (const ScanPortion& portion : portions) count += portion.sensor.size();
  if (count >= kManyPoints) surface.PrepareNear(options.thread_count);
  return BestFit(surface, portions, zero_from_part_nominal, calibration, options).Run();
}

}  // namespace sixpoint::metrology
