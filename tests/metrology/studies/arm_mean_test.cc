#include "metrology/studies/arm_mean.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

// The thesis' arm: 3 um, 0.005 deg.
ArmSpread Arm() {
  ArmSpread arm;
  arm.covariance.setZero();
  arm.covariance.diagonal() << Eigen::Vector3d::Constant(std::pow(0.005 * kRadPerDeg, 2)),
      Eigen::Vector3d::Constant(9e-6);
  arm.degrees_of_freedom = 14;
  return arm;
}

// One height sees a turn about Y badly.
Matrix6d NoiseOfOneHeight() {
  Matrix6d noise = Matrix6d::Zero();
  noise.diagonal() << std::pow(0.0005 * kRadPerDeg, 2), std::pow(0.02 * kRadPerDeg, 2), std::pow(0.001 * kRadPerDeg, 2),
      1e-8, 1e-8, 1e-8;
  return noise;
}

Vector6d Draw(const Matrix6d& covariance, std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  Vector6d unit;
  for (double& one : unit) one = normal(*random);
  return Matrix6d(covariance.llt().matrixL()) * unit;
}

// What is stated of the mean by the shares and the scans' noise is what it is off by: whitened, its mean square is 1.
TEST(ArmMean, IsAsFarOffAsItsSharesSay) {
  const ArmSpread arm = Arm();
  for (const int swings : {1, 4, 15}) {
    double whitened = 0, stated_um = 0;
    constexpr int kDraws = 2000;
    std::mt19937_64 random(swings);
    for (int draw = 0; draw < kDraws; ++draw) {
      const Vector6d calibrated = Draw(arm.covariance, &random);  // where the arm stood, about its mean
      std::vector<SwungScan> scans;
      for (int i = 0; i < swings; ++i) {
        SwungScan& scan = scans.emplace_back();
        scan.arm_series = "s" + std::to_string(i);
        scan.covariance = NoiseOfOneHeight();
        scan.displacement = Draw(arm.covariance, &random) - calibrated + Draw(scan.covariance, &random);
      }
      const auto mean = FindMeanOfSwings("calibrated", scans, arm);
      ASSERT_TRUE(mean.ok()) << mean.status();
      Matrix6d stated = mean->covariance, together = Matrix6d::Zero();
      for (const ArmShare& share : mean->shares) {
        stated += share.response * arm.covariance * share.response.transpose();
        together += share.response;
      }
      ASSERT_LT((together - Matrix6d::Identity()).cwiseAbs().maxCoeff(), 1e-9);
      const Vector6d error = calibrated + mean->displacement;
      whitened += stated.llt().matrixL().solve(error).squaredNorm() / 6 / kDraws;
      stated_um = 1e3 * std::sqrt(stated(5, 5));
    }
    EXPECT_NEAR(whitened, 1, 0.05) << swings;
    EXPECT_NEAR(stated_um, 3 / std::sqrt(swings + 1.0), 0.05) << swings;  // of the shift, which every scan sees
  }
}

// Two scans of one series are one swing.
TEST(ArmMean, CountsASeriesOnce) {
  std::vector<SwungScan> scans(3);
  for (SwungScan& scan : scans) scan.covariance = NoiseOfOneHeight();
  scans[0].arm_series = scans[1].arm_series = "a";
  scans[2].arm_series = "b";
  const auto mean = FindMeanOfSwings("c", scans, Arm());
  ASSERT_TRUE(mean.ok()) << mean.status();
  ASSERT_EQ(mean->shares.size(), 3u);
  EXPECT_EQ(mean->shares[0].arm_series, "c");
  for (const ArmShare& share : mean->shares) EXPECT_NEAR(share.response(5, 5), 1.0 / 3, 1e-3) << share.arm_series;
}

TEST(ArmMean, RefusesWhatIsNoOtherSwing) {
  SwungScan scan;
  scan.covariance = NoiseOfOneHeight();
  EXPECT_FALSE(FindMeanOfSwings("c", {}, Arm()).ok());
  EXPECT_FALSE(FindMeanOfSwings("c", {scan}, Arm()).ok());  // nobody knows of which
  scan.arm_series = "c";
  EXPECT_FALSE(FindMeanOfSwings("c", {scan}, Arm()).ok());
  scan.arm_series = "d";
  EXPECT_TRUE(FindMeanOfSwings("c", {scan}, Arm()).ok());
  scan.displacement[2] = std::nan("");
  EXPECT_FALSE(FindMeanOfSwings("c", {scan}, Arm()).ok());
}

}  // namespace
}  // namespace sixpoint::metrology
