#include "metrology/registration/form_deviation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>

#include "metrology/linear_algebra/symmetric.h"
#include "metrology/statistics/standard_deviation.h"

namespace sixpoint::metrology {
namespace {

constexpr std::array<double, FormDraws::kLengthCount> kLengths_mm = {5.0, 10.0, 20.0};
constexpr double kLeastLeft = 0.1;   // of the field's mean square: more is not taken up by six directions
constexpr int kStride = 4;           // of the points: a smooth field is known from some
constexpr double kNormalLength = 1;  // of the difference of two unit normals

// Waves of random direction and phase, whose mean product is the Gaussian covariance of their length (Rahimi and Recht 2007).
struct Waves {
  Eigen::Matrix<double, FormDraws::kCount, 3> per_mm, per_normal;
  Eigen::Matrix<double, FormDraws::kCount, 1> phase;
};

Waves MakeWaves() {
  std::mt19937_64 random(20261123);
  const auto uniform = [&] { return (static_cast<double>(random() >> 11) + 0.5) * 0x1p-53; };
  // Box and Muller: the same on every library.
  const auto normal = [&] {
    const double radius = std::sqrt(-2 * std::log(uniform()));
    return radius * std::cos(2 * M_PI * uniform());
  };
  Waves waves;
  for (int k = 0; k < FormDraws::kCount; ++k) {
    const double length_mm = kLengths_mm[static_cast<std::size_t>(k) % kLengths_mm.size()];
    for (int axis = 0; axis < 3; ++axis) waves.per_mm(k, axis) = normal() / length_mm;
    for (int axis = 0; axis < 3; ++axis) waves.per_normal(k, axis) = normal() / kNormalLength;
    waves.phase[k] = 2 * M_PI * uniform();
  }
  return waves;
}

}  // namespace

Eigen::Matrix<double, FormDraws::kCount, 1> FormDraws::At(const Eigen::Vector3d& part_mm,
                                                          const Eigen::Vector3d& normal) {
  static const Waves waves = MakeWaves();
  // Cosines of single precision: several at once, and a millionth of a draw is nothing.
  const Eigen::Matrix<double, kCount, 1> angles = waves.per_mm * part_mm + waves.per_normal * normal + waves.phase;
  return std::sqrt(2.0 * kLengthCount / kCount) * angles.cast<float>().array().cos().matrix().cast<double>();
}

Matrix6d MeanRoot(const Eigen::Matrix<double, 6, FormDraws::kCount>& per_draw) {
  const Matrix6d mean = per_draw * per_draw.transpose() / FormDraws::kLengthCount;
  return FactorOf(mean);
}

FormPull::FormPull(const Eigen::MatrixXd& mapping) {
  const EigenSystem eigen = EigenSystemOf(mapping);
  const Eigen::VectorXd roots = eigen.values.cwiseMax(0).cwiseSqrt();
  const Eigen::Index count = (roots.array() > 0).count();  // in ascending order: those at the end
  mapping_root_ = eigen.vectors.rightCols(count) * roots.tail(count).asDiagonal();
  mapping_pull_.setZero(6, count);
}

void FormPull::Add(const FittedPoint& point) {
  if (seen_count_++ % kStride != 0) return;
  const double weight = kStride * point.weight;
  const Vector6d weighted = weight * point.row;
  pull_ += weighted * FormDraws::At(point.part_mm, point.normal).transpose();
  const Eigen::RowVectorXd draws = point.by_mapping * mapping_root_;
  mapping_pull_ += weighted * draws;
  mapping_squares_ += weight * draws.squaredNorm();
  weight_ += weight;
}

Matrix6d FormPull::Root(const Matrix6d& solver, double seen_mm, double least_mm) const {
  const double explained_mm2 =
      (mapping_squares_ - (mapping_pull_.transpose() * solver * mapping_pull_).trace()) / weight_;
  const double beyond_mm = StandardDeviation(seen_mm * seen_mm - explained_mm2);
  Matrix6d mean = Matrix6d::Zero();  // over the lengths
  for (int length = 0; length < FormDraws::kLengthCount; ++length) {
    Matrix6d covariance = Matrix6d::Zero();
    double taken = 0;  // of the field's mean square, by the fit
    for (int k = length; k < FormDraws::kCount; k += FormDraws::kLengthCount) {
      const Vector6d change = solver * pull_.col(k);
      covariance += change * change.transpose();
      taken += pull_.col(k).dot(change) / weight_;
    }
    const double sigma_mm = std::max(least_mm, beyond_mm / std::sqrt(std::max(kLeastLeft, 1 - taken)));
    mean += sigma_mm * sigma_mm / FormDraws::kLengthCount * covariance;
  }
  return FactorOf(mean);
}

}  // namespace sixpoint::metrology
