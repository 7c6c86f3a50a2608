#include "metrology/calibration/rotation_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;
constexpr double kDeg = M_PI / 180;

RotaryAxes Truth() {
  return {{Eigen::Vector3d(1.1e-4, 1, 3e-6).normalized(), {26.63, 54.88, -193.322}},
          {Eigen::Vector3d(1, -9.7e-5, 2e-5).normalized(), {26.63, 54.871, -193.324}}};
}
RotationOptions Nominal() {
  RotationOptions options;
  options.nominal.a.point_mm = options.nominal.b.point_mm = {26.6352, 54.8952, -193.32};
  return options;
}
const Eigen::Vector3d kSphere(52, 59, -128);

std::vector<SpherePose> Poses(const RotaryAxes& axes, double noise_mm, std::mt19937_64* random) {
  std::normal_distribution<double> noise(0, 1);
  std::vector<SpherePose> poses;
  for (int a = -60; a <= 60; a += 40)
    for (int b = 0; b < 360; b += 40) {
      SpherePose pose{a * kDeg, b * kDeg, axes.MachineFromZero(a * kDeg, b * kDeg) * kSphere, poses.size() % 4 == 3};
      if (noise_mm > 0) pose.centre_mm += noise_mm * Eigen::Vector3d(noise(*random), noise(*random), noise(*random));
      poses.push_back(pose);
    }
  return poses;
}

// Error in the parameters of the covariance: the truth's lines as tangent coordinates at the lines found.
Eigen::Matrix<double, 8, 1> ErrorOf(const RotaryAxes& found, const RotaryAxes& truth) {
  Eigen::Matrix<double, 8, 1> error;
  int k = 0;
  for (const auto& [f, t] : {std::pair{found.a, truth.a}, {found.b, truth.b}}) {
    const Eigen::Matrix<double, 3, 2> across = TangentBasis(f.direction);
    const Eigen::Vector3d on_truth = t.point_mm + t.direction * t.direction.dot(f.point_mm - t.point_mm);
    error.segment<2>(k) = across.transpose() * (f.direction - t.direction);
    error.segment<2>(k + 2) = across.transpose() * (f.point_mm - on_truth);
    k += 4;
  }
  return error;
}

TEST(RotationCalibration, RecoversBothLinesExactlyWithoutNoise) {
  const auto result = CalibrateRotation(Poses(Truth(), 0, nullptr), Nominal());
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE(result->converged);
  EXPECT_LT(ErrorOf(result->axes, Truth()).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((result->sphere_in_zero_mm - kSphere).norm(), 1e-9);
  EXPECT_LT((result->point_c_mm - Truth().PointC()).norm(), 1e-9);
  EXPECT_LT(result->check_rms_mm, 1e-9);
  EXPECT_EQ(result->check_count, 9);
}

// Whitened by the reported covariance, with the noise stated: 200 seeds of 8 parameters scatter by sqrt(2/1600) = 0.035.
// The bound is the reported covariance itself, whose Jacobian is checked against differences below.
TEST(RotationCalibration, ReachesTheBoundWithHonestCoverage) {
  constexpr int kSeeds = 200;
  constexpr double kNoise = 1e-3;
  RotationOptions options = Nominal();
  options.standard_uncertainty_mm = kNoise;
  double pooled = 0;
  int covered = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    const auto result = CalibrateRotation(Poses(Truth(), kNoise, &random), options);
    ASSERT_TRUE(result.ok()) << result.status();
    const Eigen::Matrix<double, 8, 1> error = ErrorOf(result->axes, Truth());
    pooled += error.dot(result->covariance.ldlt().solve(error)) / 8 / kSeeds;
    for (int k = 0; k < 8; ++k) covered += std::abs(error(k)) <= 1.96 * std::sqrt(result->covariance(k, k));
  }
  const double coverage = 100.0 * covered / (8 * kSeeds);
  std::printf("variance over bound %.3f, 95 %% intervals cover %.1f %%\n", pooled, coverage);
  EXPECT_NEAR(pooled, 1, 0.15);
  EXPECT_GT(coverage, 93);
  EXPECT_LT(coverage, 97.5);
}

// The bound computed apart: Fisher information of all fitted poses by central differences.
TEST(RotationCalibration, ReportsTheInverseFisherInformation) {
  RotationOptions options = Nominal();
  options.standard_uncertainty_mm = 1e-3;
  const std::vector<SpherePose> poses = Poses(Truth(), 0, nullptr);
  const auto result = CalibrateRotation(poses, options);
  ASSERT_TRUE(result.ok());
  Eigen::Matrix<double, 11, 11> information = Eigen::Matrix<double, 11, 11>::Zero();
  for (const SpherePose& pose : poses) {
    if (pose.held_out) continue;
    Eigen::Matrix<double, 3, 11> jacobian;
    for (int k = 0; k < 11; ++k) {
      const auto at = [&](double step) {
        Eigen::Matrix<double, 8, 1> w = Eigen::Matrix<double, 8, 1>::Zero();
        Eigen::Vector3d sphere = result->sphere_in_zero_mm;
        if (k < 8)
          w(k) = step;
        else
          sphere(k - 8) += step;
        return Eigen::Vector3d(result->axes.Perturbed(w).MachineFromZero(pose.a_rad, pose.b_rad) * sphere);
      };
      jacobian.col(k) = (at(1e-5) - at(-1e-5)) / 2e-5;
    }
    information += jacobian.transpose() * jacobian / 1e-6;
  }
  const Matrix8d bound = Eigen::Matrix<double, 11, 11>(information.inverse()).topLeftCorner<8, 8>();
  EXPECT_LT((result->covariance - bound).cwiseAbs().maxCoeff(), 1e-4 * bound.cwiseAbs().maxCoeff());
}

TEST(RotationCalibration, DoesNotDependOnWhereThePlaneOfTheBedIs) {
  const Eigen::Vector3d shift(100, -250, 40);
  std::mt19937_64 random(9);
  std::vector<SpherePose> poses = Poses(Truth(), 1e-3, &random);
  const auto here = CalibrateRotation(poses, Nominal());
  RotationOptions options = Nominal();
  options.nominal.a.point_mm += shift;
  options.nominal.b.point_mm += shift;
  for (SpherePose& pose : poses) pose.centre_mm += shift;
  const auto there = CalibrateRotation(poses, options);
  ASSERT_TRUE(here.ok() && there.ok());
  EXPECT_LT((there->axes.a.point_mm - here->axes.a.point_mm - shift).norm(), 1e-9);
  EXPECT_LT((there->axes.b.direction - here->axes.b.direction).norm(), 1e-12);
  EXPECT_NEAR(there->check_rms_mm, here->check_rms_mm, 1e-9);
}

TEST(RotationCalibration, PointCIsExactWhereTheAxesMeet) {
  RotaryAxes ideal = Nominal().nominal;
  const Eigen::Vector3d c(26.6182, 54.8481, -193.1247);  // the paper's
  ideal.a.point_mm = ideal.b.point_mm = c;
  const auto result = CalibratePointC(Poses(ideal, 0, nullptr), Nominal());
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_LT((result->point_c_mm - c).norm(), 1e-9);
  // And on axes that do not meet, the lines explain the held-out poses better.
  const auto point = CalibratePointC(Poses(Truth(), 0, nullptr), Nominal());
  const auto lines = CalibrateRotation(Poses(Truth(), 0, nullptr), Nominal());
  ASSERT_TRUE(point.ok() && lines.ok());
  EXPECT_GT(point->check_rms_mm, 10 * lines->check_rms_mm + 1e-3);
}

TEST(RotationCalibration, RefusesWhatDoesNotDetermineAnAxis) {
  const auto refused = [](const std::vector<SpherePose>& poses) {
    const auto lines = CalibrateRotation(poses, Nominal());
    return lines.ok() ? "accepted" : std::string(lines.status().message());
  };
  std::vector<SpherePose> poses = Poses(Truth(), 0, nullptr);
  EXPECT_THAT(refused({poses[0]}), HasSubstr("A axis is not determined"));
  EXPECT_THAT(refused({}), HasSubstr("A axis is not determined"));
  std::vector<SpherePose> one_b;
  for (const SpherePose& p : poses)
    if (p.b_rad == 0) one_b.push_back(p);
  EXPECT_THAT(refused(one_b), HasSubstr("B axis is not determined"));
  std::vector<SpherePose> nan = poses;
  nan[2].centre_mm.y() = std::nan("");
  EXPECT_THAT(refused(nan), HasSubstr("poses[2]"));
  std::vector<SpherePose> inches = poses;
  for (SpherePose& p : inches) p.centre_mm /= 25.4;
  EXPECT_THAT(refused(inches), HasSubstr("check the poses' units"));
  std::vector<SpherePose> blunder = poses;
  blunder[4].centre_mm.x() += 5;
  EXPECT_THAT(refused(blunder), HasSubstr("um from the fit"));
}

}  // namespace
}  // namespace sixpoint::metrology
