#include "metrology/correction/distance_quantile.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

constexpr double kPi = 3.14159265358979323846;

Eigen::Vector3d VariancesDescending(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver((covariance + covariance.transpose()) / 2,
                                                              Eigen::EigenvaluesOnly);
  // Rounding may leave a variance slightly below zero.
  return solver.eigenvalues().reverse().cwiseMax(0.0);
}

// l sorted, l[0] = 1. With z the normal deviate along the first axis and (r, phi) polar across it, r^2 is exponential:
// P = integral n(z) mean_phi(1 - exp(-(R^2 - z^2) / (2 (l1 cos^2 phi + l2 sin^2 phi)))) dz over |z| < R.
double Probability(const Eigen::Vector3d& l, double radius) {
  constexpr int kSteps = 256, kAngles = 32;
  // z = R sin t: the integrand is then smooth and even about both ends, where the trapezoid rule converges fast.
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double t = (i + 0.5) / kSteps * kPi / 2;
    const double z = radius * std::sin(t), rest = radius * std::cos(t);
    double inside = 0;
    for (int k = 0; k < kAngles; ++k) {
      const double phi = (k + 0.5) / kAngles * kPi / 2;
      const double variance = l[1] * std::cos(phi) * std::cos(phi) + l[2] * std::sin(phi) * std::sin(phi);
      inside += variance > 0 ? -std::expm1(-rest * rest / (2 * variance)) : 1;
    }
    sum += std::exp(-z * z / 2) * inside / kAngles * rest;
  }
  return std::min(1.0, 2 * sum * (kPi / 2 / kSteps) / std::sqrt(2 * kPi));
}

}  // namespace

double DistanceProbability(const Eigen::Matrix3d& covariance, double radius) {
  const Eigen::Vector3d variances = VariancesDescending(covariance);
  if (!(variances[0] > 0)) return radius >= 0 ? 1 : 0;
  return Probability(variances / variances[0], std::max(0.0, radius) / std::sqrt(variances[0]));
}

double DistanceQuantile(const Eigen::Matrix3d& covariance, double probability) {
  const Eigen::Vector3d variances = VariancesDescending(covariance);
  if (!(variances[0] > 0)) return 0;
  const Eigen::Vector3d l = variances / variances[0];
  double low = 0, high = 1;
  while (Probability(l, high) < probability && high < 64) high *= 2;
  for (int i = 0; i < 50; ++i) {
    const double middle = (low + high) / 2;
    (Probability(l, middle) < probability ? low : high) = middle;
  }
  return std::sqrt(variances[0]) * (low + high) / 2;
}

}  // namespace sixpoint::metrology
