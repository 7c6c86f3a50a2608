#include "metrology/statistics/distance_quantile.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace sixpoint::metrology {
namespace {

constexpr double kPi = 3.14159265358979323846;

Eigen::Vector3d VariancesDescending(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver((covariance + covariance.transpose()) / 2,
                                                              Eigen::EigenvaluesOnly);
  // Rounding may leave a variance slightly below zero.
  return solver.eigenvalues().reverse().cwiseMax(0.0);
}

// Nodes and weights of Gauss and Legendre's rule on [0, 1], by Newton's method on the Legendre polynomial.
struct GaussRule {
  static constexpr int kPoints = 64;
  std::array<double, kPoints> nodes, weights;
  GaussRule() {
    for (int i = 0; i < kPoints; ++i) {
      double x = std::cos(kPi * (i + 0.75) / (kPoints + 0.5)), slope = 1;
      for (int step = 0; step < 8; ++step) {
        double below = 1, value = x;
        for (int n = 2; n <= kPoints; ++n) {
          const double next = ((2 * n - 1) * x * value - (n - 1) * below) / n;
          below = value;
          value = next;
        }
        slope = kPoints * (x * value - below) / (x * x - 1);
        x -= value / slope;
      }
      nodes[i] = (1 - x) / 2;
      weights[i] = 1 / ((1 - x * x) * slope * slope);
    }
  }
};

// l sorted, l[0] = 1. With z the normal deviate along the first axis and (r, phi) polar across it, r^2 is exponential:
// P = integral n(z) mean_phi(1 - exp(-(R^2 - z^2) / (2 (l1 cos^2 phi + l2 sin^2 phi)))) dz over |z| < R.
double Probability(const Eigen::Vector3d& l, double radius) {
  constexpr int kAngles = 24;
  static const GaussRule rule;
  std::array<double, kAngles> variances;
  for (int k = 0; k < kAngles; ++k) {
    const double phi = (k + 0.5) / kAngles * kPi / 2;
    variances[k] = l[1] * std::cos(phi) * std::cos(phi) + l[2] * std::sin(phi) * std::sin(phi);
  }
  double sum = 0;
  for (int i = 0; i < GaussRule::kPoints; ++i) {
    // z = R sin t: the nodes crowd where little is left for the other two directions.
    const double t = rule.nodes[i] * kPi / 2;
    const double z = radius * std::sin(t), rest = radius * std::cos(t);
    double inside = 0;
    for (const double variance : variances) inside += variance > 0 ? -std::expm1(-rest * rest / (2 * variance)) : 1;
    sum += rule.weights[i] * std::exp(-z * z / 2) * inside / kAngles * rest;
  }
  return std::min(1.0, 2 * sum * (kPi / 2) / std::sqrt(2 * kPi));
}

}  // namespace

double DistanceQuantile(const Eigen::Matrix3d& covariance, double probability) {
  if (!covariance.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector3d variances = VariancesDescending(covariance);
  if (!(variances[0] > 0)) return 0;
  const Eigen::Vector3d l = variances / variances[0];
  double low = 0, high = 1;
  while (Probability(l, high) < probability && high < 64) high *= 2;
  for (int i = 0; i < 44; ++i) {
    const double middle = (low + high) / 2;
    (Probability(l, middle) < probability ? low : high) = middle;
  }
  return std::sqrt(variances[0]) * (low + high) / 2;
}

}  // namespace sixpoint::metrology
