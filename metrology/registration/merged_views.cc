#include "metrology/registration/merged_views.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "metrology/linear_algebra/inverse.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/registration/patch_sums.h"
#include "metrology/statistics/distributions.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kWidthInSigmas = 6;
constexpr std::int64_t kLeastPoints = 5;  // of a patch whose mean counts
constexpr double kToldApart = 1e-6;       // of the greatest eigenvalue
constexpr int kParameters = kCalibrationParameterCount;
using Parameters = CalibrationVector;

// What one scan says of one place.
struct Reading {
  std::uint32_t portion = 0;
  double offset_mm = 0, weight = 0;  // weight: inverse of the variance
  Parameters sensitivity = Parameters::Zero();
  Eigen::Vector2d by_angle = Eigen::Vector2d::Zero();  // per radian of a and b
};

class Merge {
 public:
  Merge(const std::vector<ScanPortion>& portions, const MachineCalibration& calibration)
      : portions_(portions), calibration_(calibration) {
    by_angles_ = MatrixXd::Zero(kParameters, static_cast<Eigen::Index>(2 * portions.size()));
  }

  // Differences of what the scans say there: each from their mean.
  void AddPlace(const std::vector<Reading>& readings) {
    double weight = 0, offset = 0;
    Parameters sensitivity = Parameters::Zero();
    for (const Reading& one : readings) {
      weight += one.weight;
      offset += one.weight * one.offset_mm;
      sensitivity += one.weight * one.sensitivity;
    }
    offset /= weight;
    sensitivity /= weight;
    for (const Reading& one : readings) {
      const Parameters apart = one.sensitivity - sensitivity;
      const double off_mm = one.offset_mm - offset;
      information_ += one.weight * apart * apart.transpose();
      score_ += one.weight * off_mm * apart;
      squares_ += one.weight * off_mm * off_mm;
      by_angles_.middleCols<2>(2 * static_cast<Eigen::Index>(one.portion)) +=
          one.weight * apart * one.by_angle.transpose();
    }
    differences_ += static_cast<int>(readings.size()) - 1;
  }

  MergeTest Test() const {
    MergeTest test;
    const Parameters diagonal = information_.diagonal();
    if (differences_ == 0 || !(diagonal.maxCoeff() > 0)) return test;
    Parameters scale = Parameters::Zero();
    const CalibrationCovariance of_calibration = CovarianceOf(calibration_);
    // What is not calibrated, and is not stated to be off, takes no part.
    const auto takes_part = [&](int k) { return k < kCalibratedParameterCount || of_calibration(k, k) > 0; };
    for (int k = 0; k < kParameters; ++k)
      if (takes_part(k) && diagonal[k] > kToldApart * kToldApart * diagonal.maxCoeff())
        scale[k] = 1 / std::sqrt(diagonal[k]);
    const EigenSystem eigen = EigenSystemOf(MatrixXd(scale.asDiagonal() * information_ * scale.asDiagonal()));
    int first = 0;
    while (eigen.values[first] < kToldApart * eigen.values[kParameters - 1]) ++first;
    const VectorXd held = eigen.values.tail(kParameters - first);
    const MatrixXd axes = (scale.asDiagonal() * eigen.vectors.rightCols(kParameters - first)).transpose();
    const VectorXd score = axes * score_;
    test.freedom = static_cast<int>(held.size());
    // Patches seen half by one scan and half by another differ by their shape too.
    const double left = squares_ - score.cwiseAbs2().cwiseQuotient(held).sum();
    const int left_freedom = differences_ - test.freedom;
    test.scatter = left_freedom > 0 ? std::sqrt(std::max(1.0, left / left_freedom)) : 1;
    MatrixXd covariance = Propagated(axes * information_, of_calibration);
    covariance += Propagated(axes * by_angles_, AngleVariances().asDiagonal());
    covariance.diagonal() += test.scatter * test.scatter * held;
    test.chi_squared = score.dot(SolvePositiveDefinite(covariance, score));
    test.limit = ChiSquaredQuantile(kMergeConfidence, test.freedom);
    test.beyond = !(test.chi_squared <= test.limit);
    return test;
  }

 private:
  // Of each scan's a and b.
  VectorXd AngleVariances() const {
    VectorXd variances(2 * static_cast<Eigen::Index>(portions_.size()));
    for (std::size_t p = 0; p < portions_.size(); ++p) {
      const auto at = 2 * static_cast<Eigen::Index>(p);
      variances[at] = std::pow(calibration_.positioning.a.StandardUncertaintyAt(portions_[p].commanded_a_rad), 2);
      variances[at + 1] = std::pow(calibration_.positioning.b.StandardUncertaintyAt(portions_[p].commanded_b_rad), 2);
    }
    return variances;
  }

  const std::vector<ScanPortion>& portions_;
  const MachineCalibration& calibration_;
  MatrixXd information_ = MatrixXd::Zero(kParameters, kParameters);
  VectorXd score_ = VectorXd::Zero(kParameters);
  MatrixXd by_angles_;
  double squares_ = 0;
  int differences_ = 0;
};

}  // namespace

absl::StatusOr<MergeTest> TestMerge(const Surface& surface, const std::vector<ScanPortion>& portions,
                                    const PoseFit& fit, const MachineCalibration& calibration,
                                    const FitOptions& options) {
  if (!fit.placed) return Refuse("merge", "a pose that has not converged", "one that has");
  const double sigma_mm = std::max(fit.evidence.noise_sigma_mm, fit.evidence.residual_sigma_mm);
  const double width_mm = std::max(kWidthInSigmas * sigma_mm, 1e-3 * options.model_error_um);
  const Eigen::Isometry3d& zero_from_part = fit.placed->zero_from_part;
  auto sums = SumPatches(surface, portions, zero_from_part, {width_mm, fit.evidence.patch_mm, false}, options);
  if (!sums.ok()) return sums.status();
  // Of a point: pooled within the patches.
  double squares = 0, freedom = 0;
  for (const Patch& patch : sums->patches) {
    squares += std::max(0.0, patch.squares - patch.pull * patch.pull / patch.weight);
    freedom += patch.weight * (1 - 1 / static_cast<double>(patch.count));
  }
  const double variance = freedom > 0 && squares > 0 ? squares / freedom : 1e-18;
  std::map<PatchKey, std::vector<const Patch*>> places;
  for (const Patch& patch : sums->patches)
    if (patch.count >= kLeastPoints) places[patch.key].push_back(&patch);
  Merge merge(portions, calibration);
  std::vector<Reading> readings;
  for (const auto& [key, patches] : places) {
    if (patches.size() < 2) continue;
    const Vector3d zero_mm = zero_from_part * (surface.centroid_mm() + PatchCentre(key, fit.evidence.patch_mm));
    readings.clear();
    for (const Patch* patch : patches) {
      const ScanPortion& portion = portions[patch->portion];
      const Vector3d normal = zero_from_part.linear() * patch->row.tail<3>().normalized();
      const Vector3d sensor_mm = portion.zero_from_sensor.inverse() * zero_mm;
      Reading reading;
      reading.portion = patch->portion;
      reading.offset_mm = patch->pull / patch->weight;
      reading.weight = static_cast<double>(patch->count) / variance;
      reading.sensitivity = (normal.transpose() * ZeroPointSensitivity(sensor_mm, zero_mm, portion.a_rad, portion.b_rad,
                                                                       calibration.sensor, calibration.axes))
                                .transpose();
      reading.by_angle =
          (normal.transpose() * ZeroPointAngleSensitivity(zero_mm, portion.a_rad, portion.b_rad, calibration.axes))
              .transpose();
      readings.push_back(reading);
    }
    merge.AddPlace(readings);
  }
  return merge.Test();
}

}  // namespace sixpoint::metrology
