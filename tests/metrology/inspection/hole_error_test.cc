#include "metrology/inspection/hole_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sixpoint::metrology {
namespace {

// The error's length is not linear near zero: its 95 % cover from no error at all to one far above its uncertainty.
TEST(HoleError, CoversFromNoErrorToSixSigma) {
  NominalPin nominal;
  nominal.normal = Eigen::Vector3d(0.3, -0.2, 1).normalized();
  constexpr double kSigma_mm = 2e-3, kTilt = 5e-4;
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  covariance.diagonal() << kSigma_mm * kSigma_mm, kSigma_mm * kSigma_mm, kTilt * kTilt, kTilt * kTilt, 1e-8;
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  for (const double sigmas : {0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0}) {
    PinFit truth;
    truth.across << Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY();
    truth.offset_mm = Eigen::Vector2d(0.6, 0.8) * sigmas * kSigma_mm;
    truth.slope = Eigen::Vector2d(-0.8, 0.6) * sigmas * kTilt;
    const HoleError exact = HoleErrorOf(nominal, truth, covariance);
    constexpr int kDraws = 2000;
    int position = 0, inclination = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      PinFit seen = truth;
      for (int k = 0; k < 2; ++k) {
        seen.offset_mm[k] += kSigma_mm * normal(random);
        seen.slope[k] += kTilt * normal(random);
      }
      const HoleError error = HoleErrorOf(nominal, seen, covariance);
      position += std::abs(error.position_mm - exact.position_mm) <=
                  error.position_coverage_factor * error.position_standard_uncertainty_mm;
      inclination += std::abs(error.inclination_rad - exact.inclination_rad) <=
                     error.inclination_coverage_factor * error.inclination_standard_uncertainty_rad;
    }
    std::printf("true error %.1f sigma: position %.1f %%, inclination %.1f %%\n", sigmas, 100.0 * position / kDraws,
                100.0 * inclination / kDraws);
    for (const int inside : {position, inclination}) {
      EXPECT_GT(100.0 * inside / kDraws, 93.5) << sigmas;
      EXPECT_LT(100.0 * inside / kDraws, 97.5) << sigmas;
    }
  }
}

}  // namespace
}  // namespace sixpoint::metrology
