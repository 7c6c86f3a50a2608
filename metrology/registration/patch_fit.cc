#include "metrology/registration/patch_fit.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "metrology/linear_algebra/pseudo_inverse.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/registration/gap_pull.h"
#include "metrology/registration/surface_residuals.h"
#include "metrology/statistics/ranks.h"
#include "metrology/statistics/standard_deviation.h"

namespace sixpoint::metrology {
namespace {

constexpr double kPatchWidth = 5;  // 96 % efficient for Gaussian errors of patches
constexpr int kMostReweightings = 60;
constexpr double kSettledInSigmas = 1e-4;  // last step, in standard deviations
// The nearest patches tell the spread: this part of them stays good where half a side is foreign.
constexpr double kNearestPatches = 0.4;
constexpr double kNearestInSigmas = 0.5244;  // that quantile of |Gaussian|
constexpr double kModelSigmaKnown = 1e-3;    // relative
constexpr double kLeastSlope = 0.3;          // of the loss; below it the step is no Newton step
constexpr int kCoarser[] = {4, 8};           // patches to a side of a cluster
constexpr std::size_t kLeastClusters = 12;

class Fitter {
 public:
  Fitter(const PatchSums& sums, const PatchFitOptions& options) : patches_(sums.patches), options_(options) {
    slope_ = std::max(kLeastSlope, sums.slope);
    double squares = 0;
    matrices_.reserve(patches_.size());
    rows_.reserve(patches_.size());
    for (const Patch& patch : patches_) {
      matrices_.push_back(patch.Matrix());
      rows_.push_back(patch.row / patch.weight);
      means_.push_back(patch.pull / patch.weight / slope_);
      // A gap's points are off together: their mean is no better known than one of them.
      const double gap_sigma = GapUncertainty(patch.Gap());
      gap_variances_.push_back(gap_sigma * gap_sigma);
      squares += patch.squares;
    }
    double weight = 0;
    for (const Patch& patch : patches_) weight += patch.weight;
    cut_ = squares > 0 ? sums.variance * weight / squares : 1;
    fit_.weights.assign(patches_.size(), 1);
    fit_.offsets_mm.assign(patches_.size(), 0);
    trust_.assign(patches_.size(), 1);
    deviations_.assign(patches_.size(), 0);
    covariance_ = options.start_covariance;
  }

  PatchFit Run() {
    if (patches_.empty()) {  // nothing is learned
      fit_.covariance = options_.start_covariance;
      fit_.normal.setZero();
      return fit_;
    }
    for (int step = 0; step < kMostReweightings; ++step) {
      FindNoise();
      Offsets();
      const double model_before = fit_.model_sigma_mm;
      FindModelSigma();
      Weigh();
      const Vector6d by = Step();
      fit_.change += by;
      covariance_ = Covariance(1);
      const double size = InSigmas(by);
      if (step > 2 && size < kSettledInSigmas &&
          std::abs(fit_.model_sigma_mm - model_before) <= 2 * kModelSigmaKnown * model_before)
        break;
    }
    Offsets();
    Weigh();
    Finish();
    return fit_;
  }

 private:
  // Pooled within the patches kept: a casting's shape is no noise.
  void FindNoise() {
    double squares = 0, weight = 0;
    for (std::size_t k = 0; k < patches_.size(); ++k) {
      const Patch& patch = patches_[k];
      if (patch.count < 2) continue;
      const auto n = static_cast<double>(patch.count);
      squares += fit_.weights[k] * std::max(0.0, patch.squares - patch.pull * patch.pull / patch.weight);
      weight += fit_.weights[k] * patch.weight * (n - 1) / n;
    }
    if (weight > 0) variance_ = cut_ * squares / weight;
    if (!(variance_ > 0)) variance_ = 1e-18;  // exact points
    fit_.noise_sigma_mm = std::sqrt(variance_) / slope_;
  }

  double NoiseVariance(std::size_t k) const { return variance_ / (slope_ * slope_ * patches_[k].weight); }

  void Offsets() {
    for (std::size_t k = 0; k < patches_.size(); ++k) fit_.offsets_mm[k] = means_[k] - rows_[k].dot(fit_.change);
  }

  // The model error with which the nearest patches spread as they should.
  void FindModelSigma() {
    std::vector<double> open(patches_.size()), ratios(patches_.size());
    double greatest = 0;
    for (std::size_t k = 0; k < patches_.size(); ++k) {
      open[k] = NoiseVariance(k) + gap_variances_[k] + rows_[k].dot(covariance_ * rows_[k]);
      greatest = std::max(greatest, std::abs(fit_.offsets_mm[k]));
    }
    const auto spread = [&](double variance) {
      for (std::size_t k = 0; k < patches_.size(); ++k)
        ratios[k] = std::abs(fit_.offsets_mm[k]) / std::sqrt(open[k] + variance);
      return AtRank(static_cast<std::size_t>(kNearestPatches * static_cast<double>(ratios.size())), &ratios);
    };
    double low = 0, high = 2 * greatest;
    if (spread(0) <= kNearestInSigmas) {
      fit_.model_sigma_mm = 0;
      return;
    }
    while (high - low > kModelSigmaKnown * high) {
      const double middle = 0.5 * (low + high);
      (spread(middle * middle) > kNearestInSigmas ? low : high) = middle;
    }
    fit_.model_sigma_mm = 0.5 * (low + high);
  }

  void Weigh() {
    for (std::size_t k = 0; k < patches_.size(); ++k) {
      const double noise = NoiseVariance(k);
      const double model = fit_.model_sigma_mm * fit_.model_sigma_mm + gap_variances_[k];
      deviations_[k] = std::sqrt(noise + model + rows_[k].dot(covariance_ * rows_[k]));
      fit_.weights[k] = TukeyWeight(fit_.offsets_mm[k], kPatchWidth * deviations_[k]);
      trust_[k] = noise / (noise + model);
    }
  }

  Matrix6d Normal() const {
    Matrix6d normal = Matrix6d::Zero();
    for (std::size_t k = 0; k < patches_.size(); ++k)
      if (fit_.weights[k] > 0) normal += fit_.weights[k] * trust_[k] * slope_ * matrices_[k];
    return normal;
  }

  Vector6d Score(std::size_t k) const {
    return fit_.weights[k] * trust_[k] * (patches_[k].right - slope_ * (matrices_[k] * fit_.change));
  }

  // Over the patches: sum of the patch loss's second derivative by sum of its weights.
  double PatchSlope() const {
    double weights = 0, slopes = 0;
    for (std::size_t k = 0; k < patches_.size(); ++k) {
      const double u = fit_.offsets_mm[k] / (kPatchWidth * deviations_[k]), inside = 1 - u * u;
      if (!(inside > 0)) continue;
      weights += trust_[k] * patches_[k].weight * inside * inside;
      slopes += trust_[k] * patches_[k].weight * inside * (1 - 5 * u * u);
    }
    return weights > 0 ? std::max(kLeastSlope, slopes / weights) : 1;
  }

  // Of the greatest, for a direction to count as held.
  double LeastEigenvalue() const { return 1 / (options_.condition_limit * options_.condition_limit); }

  Vector6d Step() const {
    Vector6d score = Vector6d::Zero();
    for (std::size_t k = 0; k < patches_.size(); ++k)
      if (fit_.weights[k] > 0) score += Score(k);
    return SolveHeldIn(Normal(), score, options_.free, LeastEigenvalue()) / PatchSlope();
  }

  // What is added to the normal matrix so that a direction which nothing holds counts as badly known, not as certain.
  Matrix6d Floor(const Matrix6d& normal) const {
    const EigenSystem eigen = EigenSystemOf(Restricted(normal, options_.free));
    const double least = LeastEigenvalue() * eigen.values[eigen.values.size() - 1];
    const Eigen::VectorXd lacking = (least - eigen.values.array()).max(0);
    return Embedded(eigen.vectors * lacking.asDiagonal() * eigen.vectors.transpose(), options_.free);
  }

  // Of the change: noise and model error through the normal matrix, in the free directions.
  Matrix6d Covariance(double widening) const {
    const Matrix6d normal = Normal(), floor = Floor(normal);
    const Matrix6d inverse = InverseIn(normal + floor, options_.free) / PatchSlope();
    return inverse * (widening * ScoreCovariance() + variance_ / slope_ * floor) * inverse;
  }

  // Of the score. A patch's model error is one with its slopes': what it says of them is worth no more.
  Matrix6d ScoreCovariance() const {
    Matrix6d covariance = Matrix6d::Zero();
    double squares = 0, weights = 0;
    for (std::size_t k = 0; k < patches_.size(); ++k) {
      const double w = fit_.weights[k];
      if (!(w > 0)) continue;
      covariance += w * w * trust_[k] * variance_ * matrices_[k];
      const double t = fit_.offsets_mm[k] / deviations_[k];
      squares += trust_[k] * patches_[k].weight * w * w * t * t;
      weights += trust_[k] * patches_[k].weight * w * w;
    }
    return weights > 0 ? Matrix6d(squares / weights * covariance) : covariance;
  }

  double InSigmas(const Vector6d& by) const {
    const Vector6d whitened = SolveHeldIn(covariance_, by, options_.free);
    return StandardDeviation(by.dot(whitened));
  }

  // How much more clusters of patches scatter than patches that err independently would.
  double Widening(const Matrix6d& independent) const {
    const double rank = static_cast<double>(std::max<Eigen::Index>(1, RankOf(independent)));
    double widening = 1;
    for (const int times : kCoarser) {
      std::map<std::pair<std::uint32_t, PatchKey>, Vector6d> clusters;
      for (std::size_t k = 0; k < patches_.size(); ++k) {
        if (!(fit_.weights[k] > 0)) continue;
        const auto [at, added] =
            clusters.emplace(std::make_pair(patches_[k].portion, CoarserKey(patches_[k].key, times)), Vector6d::Zero());
        at->second += Score(k);
      }
      if (clusters.size() < kLeastClusters) break;
      Matrix6d scattered = Matrix6d::Zero();
      for (const auto& [key, score] : clusters) scattered += score * score.transpose();
      const double ratio = ShortestSolutions(independent, scattered).trace() / rank;
      // Of independent patches the ratio scatters by this.
      const double chance = std::sqrt(2 / (rank * static_cast<double>(clusters.size())));
      if (ratio > 1 + 2.5 * chance) widening = std::max(widening, ratio);
    }
    return widening;
  }

  void Finish() {
    fit_.normal = Normal();
    fit_.correlation_widening = Widening(ScoreCovariance());
    fit_.covariance = Covariance(fit_.correlation_widening);
    const Vector6d weakest = options_.free * EigenSystemOf(Restricted(fit_.normal, options_.free)).vectors.col(0);
    double kept = 0, all = 0;
    fit_.slopes.resize(patches_.size());
    for (std::size_t k = 0; k < patches_.size(); ++k) {
      const double information = trust_[k] * weakest.dot(matrices_[k] * weakest);
      kept += fit_.weights[k] * information;
      all += information;
      const double u = fit_.offsets_mm[k] / (kPatchWidth * deviations_[k]), inside = 1 - u * u;
      fit_.slopes[k] = inside > 0 ? trust_[k] * inside * (1 - 5 * u * u) : 0;
    }
    fit_.information_kept = all > 0 ? kept / all : 1;
  }

  const std::vector<Patch>& patches_;
  const PatchFitOptions& options_;
  PatchFit fit_;
  std::vector<Matrix6d, Eigen::aligned_allocator<Matrix6d>> matrices_;
  std::vector<Vector6d, Eigen::aligned_allocator<Vector6d>> rows_;
  std::vector<double> means_, gap_variances_, trust_, deviations_;
  Matrix6d covariance_;
  double slope_ = 1;     // of the points' loss
  double cut_ = 1;       // sum of w^2 r^2 by sum of w r^2
  double variance_ = 0;  // of a point's pull, by weight
};

}  // namespace

PatchFit FitPatches(const PatchSums& sums, const PatchFitOptions& options) { return Fitter(sums, options).Run(); }

}  // namespace sixpoint::metrology
