#include <absl/status/status.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "metrology/registration/registration.h"
#include "metrology/registration/surface_residuals.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::size_t kCoarseCount = 24'000;
constexpr std::size_t kManyPoints = 200'000;  // from here on it pays to prepare the surface for them
constexpr double kAnnealing = 0.65;           // the loss narrows by this, once the pose rests at its present width
constexpr double kStepLimitMm = 3;            // of one step
constexpr double kConverged = 1e-3;           // last step, in standard deviations
// The loss keeps at least this part of the points within reach. In Gaussian noise alone that quantile of |residual| is
// 0.524 standard deviations; a little less than its inverse, so that up to a third of the points may be foreign.
constexpr double kNearestPart = 0.4;
constexpr double kNearestToSigma = 0.6 / 0.524;
constexpr double kLeastShareOfScan = 0.6;  // of the part used of all points, below which a scan is named
constexpr std::size_t kBatchSize = 128;    // neighbours whose errors may be correlated

std::string Um(double mm) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g um", 1e3 * mm);
  return text;
}

std::string Percent(double part) { return std::to_string(static_cast<int>(100 * part)) + " %"; }

// The directions in which the points do not hold the part.
std::string FreeDirections(const Matrix6d& matrix, double condition_limit) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(matrix);
  std::string listed;
  int count = 0;
  for (int k = 0; k < 6; ++k) {
    if (eigen.eigenvalues()[k] * condition_limit * condition_limit > eigen.eigenvalues()[5]) break;
    const Vector6d v = eigen.eigenvectors().col(k);
    char text[96];
    std::snprintf(text, sizeof text, "%s(%.2f %.2f %.2f, %.2f %.2f %.2f)", count++ > 0 ? ", " : "", v[0], v[1], v[2],
                  v[3], v[4], v[5]);
    listed += text;
  }
  return "the points leave " + std::to_string(count) +
         " directions free (turn about x, y, z by the radius of gyration, shift along x, y, z): " + listed;
}

// Scans whose points the loss threw out far more than the others': a wrong calibration, a dent, or a part held there.
std::string StandingOff(const FitEvidence& evidence) {
  std::string listed;
  for (const PortionEvidence& portion : evidence.portions) {
    const double used =
        static_cast<double>(portion.points_used) / static_cast<double>(std::max<std::int64_t>(1, portion.point_count));
    if (used < kLeastShareOfScan * evidence.overlap)
      listed += (listed.empty() ? "" : ", ") + portion.scan + " (" + Percent(used) + ")";
  }
  return listed.empty() ? "" : "few points used of: " + listed + "; of all " + Percent(evidence.overlap);
}

// All samples; or pairs of neighbours, spread evenly, about `count` of them.
std::vector<Sample> Samples(const std::vector<ScanPortion>& portions, std::size_t count) {
  std::size_t total = 0;
  for (const ScanPortion& portion : portions) total += portion.zero_mm.size();
  const std::size_t stride = std::max<std::size_t>(1, total / std::max<std::size_t>(1, count));
  std::vector<Sample> samples;
  samples.reserve(std::min(total, count + 2 * portions.size()));
  for (std::size_t p = 0; p < portions.size(); ++p) {
    bool before = false;
    for (std::size_t i = 0; i < portions[p].zero_mm.size(); ++i) {
      const bool kept = stride == 1 || i % (2 * stride) < 2;
      if (kept) {
        Sample sample;
        sample.zero_mm = portions[p].zero_mm[i];
        sample.portion = static_cast<std::uint32_t>(p);
        sample.index = static_cast<std::uint32_t>(i);
        sample.follows = before;
        samples.push_back(sample);
      }
      before = kept;
    }
  }
  return samples;
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
        coarse_(surface, Samples(portions, kCoarseCount), reference_mm_, options.thread_count),
        pose_(nominal) {}

  absl::StatusOr<PoseFit> Run() {
    if (const absl::Status status = FindPose(); !status.ok()) return status;
    SurfaceResiduals all(surface_, Samples(portions_, SIZE_MAX), reference_mm_, options_.thread_count);
    bool converged = false;
    const double final_sigma = sigma_mm_;
    for (int i = 0; i < 20 && !converged; ++i) {
      if (const absl::Status status = GoOn(); !status.ok()) return status;
      all.Search(pose_, 2 * kTukeyWidth * final_sigma);
      converged = Move(all, all.Minimise(Vector6d::Zero(), kTukeyWidth * final_sigma, 10)) < kConverged * final_sigma;
    }
    return Report(all, converged);
  }

 private:
  absl::Status GoOn() const {
    if (options_.keep_going && !options_.keep_going())
      return absl::CancelledError("registration: stopped by its caller");
    return absl::OkStatus();
  }

  // Applies a scaled change; returns its size.
  double Move(const SurfaceResiduals& residuals, Vector6d change) {
    ++iteration_count_;
    const double size = change.norm();
    if (size > kStepLimitMm) change *= kStepLimitMm / size;
    pose_ = Perturbed(pose_, residuals.Unscaled(change), reference_mm_);
    pose_.linear() = Eigen::Quaterniond(pose_.linear()).normalized().toRotationMatrix();
    return size;
  }

  // From a standard deviation down to `final`, the pose coming to rest at each width before the next.
  absl::Status Anneal(double sigma_mm, double annealing, const std::vector<double>* portion_weights) {
    while (iteration_count_ < options_.iteration_limit) {
      if (const absl::Status status = GoOn(); !status.ok()) return status;
      const double width = kTukeyWidth * sigma_mm;
      coarse_.Search(pose_, std::min(1.5 * width + 0.01, 2 * options_.greatest_start_error_mm));
      const double step = Move(coarse_, coarse_.Minimise(Vector6d::Zero(), width, 4, portion_weights));
      if (step > 0.25 * sigma_mm) continue;
      const double final_sigma = FinalSigma(coarse_);
      if (sigma_mm <= final_sigma && step < kConverged * sigma_mm) break;
      sigma_mm_ = sigma_mm = std::min(sigma_mm, std::max(final_sigma, annealing * sigma_mm));
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
    const auto nearest =
        distances.begin() + static_cast<std::ptrdiff_t>(kNearestPart * static_cast<double>(distances.size()));
    std::nth_element(distances.begin(), nearest, distances.end());
    return std::max(std::hypot(residuals.NeighbourNoise(), 1e-3 * options_.model_error_um), kNearestToSigma * *nearest);
  }

  absl::Status FindPose() {
    coarse_.Search(pose_, options_.greatest_start_error_mm);
    std::vector<double> distances;
    for (const Sample& sample : coarse_.samples())
      if (sample.usable) distances.push_back(std::abs(sample.residual_mm));
    const double start = std::clamp(1.4826 * Median(std::move(distances)), 0.02, options_.greatest_start_error_mm);
    sigma_mm_ = start;
    return Anneal(start, kAnnealing, nullptr);
  }

  absl::StatusOr<PoseFit> Report(const SurfaceResiduals& all, bool converged);
  void Propagate(const SurfaceResiduals& all, double width_mm, PoseFit* fit) const;

  const Surface& surface_;
  const std::vector<ScanPortion>& portions_;
  const MachineCalibration& calibration_;
  const FitOptions& options_;
  const Vector3d reference_mm_;
  SurfaceResiduals coarse_;
  Isometry3d pose_;
  double sigma_mm_ = 0;
  int iteration_count_ = 0;
};

// Noise: the M-estimator's sandwich A^-1 B A^-1, with A the sum of psi' J J^T and B that of psi^2 J J^T; B is widened where
// batches of neighbours scatter more than independent errors would. Calibrations: A^-1 sum psi' J (n . dp/dtheta).
void BestFit::Propagate(const SurfaceResiduals& all, double width_mm, PoseFit* fit) const {
  using Sensitivity = Eigen::Matrix<double, 6, kCalibrationParameterCount>;
  struct Sums {
    Matrix6d a = Matrix6d::Zero(), b = Matrix6d::Zero(), batched = Matrix6d::Zero();
    Sensitivity moved = Sensitivity::Zero();
  };
  const auto& samples = all.samples();
  std::vector<Sums> parts(ChunkCount(samples.size()));
  ForEachChunk(samples.size(), options_.thread_count, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    Sums sums;
    Vector6d score = Vector6d::Zero();
    for (std::size_t i = begin; i < end; ++i) {
      const Sample& sample = samples[i];
      const double u = sample.residual_mm / width_mm;
      if (sample.usable && u * u < 1) {
        const Vector6d row = all.Row(sample);
        const double psi = sample.residual_mm * (1 - u * u) * (1 - u * u), slope = (1 - u * u) * (1 - 5 * u * u);
        sums.a += slope * row * row.transpose();
        sums.b += psi * psi * row * row.transpose();
        score += psi * row;
        const ScanPortion& portion = portions_[sample.portion];
        sums.moved += slope * row *
                      (sample.normal.transpose() * ZeroPointSensitivity(portion.sensor_mm[sample.index], sample.zero_mm,
                                                                        portion.a_rad, portion.b_rad, calibration_));
      }
      if ((i + 1 - begin) % kBatchSize == 0 || i + 1 == end) {
        sums.batched += score * score.transpose();
        score.setZero();
      }
    }
    parts[chunk] = sums;
  });
  Sums sum;
  for (const Sums& part : parts) {
    sum.a += part.a;
    sum.b += part.b;
    sum.batched += part.batched;
    sum.moved += part.moved;
  }
  const Matrix6d inverse = sum.a.completeOrthogonalDecomposition().pseudoInverse();
  const double widening = std::max(1.0, (sum.b.completeOrthogonalDecomposition().solve(sum.batched)).trace() / 6);
  Vector6d unscale = Vector6d::Ones();
  unscale.head<3>().setConstant(1 / all.radius_mm());
  const Matrix6d noise = widening * (inverse * sum.b * inverse);
  fit->noise_covariance.reference_mm = fit->covariance.reference_mm = reference_mm_;
  fit->noise_covariance.values = unscale.asDiagonal() * noise * unscale.asDiagonal();
  fit->calibration_sensitivity = unscale.asDiagonal() * (inverse * sum.moved);
  fit->covariance.values = fit->noise_covariance.values + fit->calibration_sensitivity * CovarianceOf(calibration_) *
                                                              fit->calibration_sensitivity.transpose();
  fit->evidence.weakest_standard_uncertainty_mm =
      std::sqrt(std::max(0.0, fit->evidence.weakest_direction.dot(noise * fit->evidence.weakest_direction)));
}

absl::StatusOr<PoseFit> BestFit::Report(const SurfaceResiduals& all, bool converged) {
  PoseFit fit;
  fit.zero_from_part = pose_;
  FitEvidence& evidence = fit.evidence;
  const double width = kTukeyWidth * sigma_mm_;
  const auto& samples = all.samples();
  std::vector<std::vector<double>> by_portion(portions_.size());
  std::vector<double> reached;
  evidence.portions.resize(portions_.size());
  double squares = 0;
  for (const Sample& sample : samples) {
    PortionEvidence& portion = evidence.portions[sample.portion];
    ++portion.point_count;
    if (!sample.usable || std::abs(sample.residual_mm) >= width) continue;
    reached.push_back(sample.residual_mm);
    by_portion[sample.portion].push_back(sample.residual_mm);
    if (TukeyWeight(sample.residual_mm, width) <= 0.5) continue;
    ++portion.points_used;
    ++evidence.points_used;
    squares += sample.residual_mm * sample.residual_mm;
  }
  evidence.point_count = static_cast<std::int64_t>(samples.size());
  evidence.overlap = static_cast<double>(evidence.points_used) / static_cast<double>(samples.size());
  evidence.iteration_count = iteration_count_;
  evidence.residual_rms_mm =
      evidence.points_used > 0 ? std::sqrt(squares / static_cast<double>(evidence.points_used)) : 0;
  evidence.residual_sigma_mm = RobustSigma(reached);
  for (std::size_t p = 0; p < portions_.size(); ++p) {
    evidence.portions[p].scan = portions_[p].id;
    evidence.portions[p].residual_median_mm = Median(std::move(by_portion[p]));
  }
  const auto equations = all.At(Vector6d::Zero(), width);
  evidence.condition_number = ConditionNumber(equations.matrix, &evidence.weakest_direction);
  Propagate(all, width, &fit);

  if (evidence.overlap < options_.least_overlap || !(sigma_mm_ < options_.greatest_spread_mm)) {
    fit.outcome = Outcome::kTooLittleOverlap;
    evidence.remark = "of the points " + Percent(evidence.overlap) + " lie on the surface, within a spread of " +
                      Um(sigma_mm_) + "; want at least " + Percent(options_.least_overlap) + " within " +
                      Um(options_.greatest_spread_mm) + ": another blade, another side or no overlap";
  } else if (!(evidence.condition_number < options_.condition_limit)) {
    fit.outcome = Outcome::kNotDetermined;
    evidence.remark = FreeDirections(equations.matrix, options_.condition_limit);
  } else {
    fit.outcome = converged ? Outcome::kConverged : Outcome::kNotConverged;
    evidence.remark = converged ? StandingOff(evidence)
                                : "the pose still moves after " + std::to_string(iteration_count_) + " iterations";
  }
  return fit;
}

}  // namespace

absl::StatusOr<PoseFit> FitToSurface(const Surface& surface, const std::vector<ScanPortion>& portions,
                                     const Isometry3d& zero_from_part_nominal, const MachineCalibration& calibration,
                                     const FitOptions& options) {
  std::size_t count = 0;
  for (const ScanPortion& portion : portions) count += portion.zero_mm.size();
  if (count < 6) return absl::InvalidArgumentError("scans: " + std::to_string(count) + " points, want at least 6");
  if (!zero_from_part_nominal.matrix().allFinite())
    return absl::InvalidArgumentError("zero_from_part_nominal: not finite, want a rigid transform");
  if (count >= kManyPoints) surface.PrepareNear(options.thread_count);
  return BestFit(surface, portions, zero_from_part_nominal, calibration, options).Run();
}

}  // namespace sixpoint::metrology
