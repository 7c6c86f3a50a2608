#include "metrology/calibration/rotation_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <random>
#include <thread>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/linear_axes.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

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
      SpherePose pose{a * kRadPerDeg, b * kRadPerDeg, axes.MachineFromZero(a * kRadPerDeg, b * kRadPerDeg) * kSphere,
                      poses.size() % 4 == 3};
      if (noise_mm > 0) pose.centre_mm += noise_mm * Eigen::Vector3d(noise(*random), noise(*random), noise(*random));
      poses.push_back(pose);
    }
  return poses;
}

// Error in the parameters of the covariance: the truth's lines as tangent coordinates at the lines found.
Eigen::Matrix<double, 8, 1> ErrorOfAxes(const RotaryAxes& found, const RotaryAxes& truth) {
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
  EXPECT_LT(ErrorOfAxes(result->axes, Truth()).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((result->sphere_in_zero_mm - kSphere).norm(), 1e-9);
  EXPECT_LT((result->point_c_mm - Truth().PointC()).norm(), 1e-9);
  EXPECT_LT(result->check_rms_mm, 1e-9);
  EXPECT_EQ(result->check_count, 9);
}

// Of a thousand sound calibrations one may be held back; a pose that is 10 um off is always seen beside 1 um of noise.
TEST(RotationCalibration, HeldOutPosesAreJudged) {
  constexpr int kSeeds = 300;
  for (const double stated_mm : {1e-3, 0.0}) {
    RotationOptions options = Nominal();
    options.standard_uncertainty_mm = stated_mm;
    int disagreed = 0, below_half = 0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      std::mt19937_64 random(seed);
      std::vector<SpherePose> poses = Poses(Truth(), 1e-3, &random);
      const auto sound = CalibrateRotation(poses, options);
      ASSERT_TRUE(sound.ok()) << sound.status();
      ASSERT_EQ(sound->judgements.size(), 1u);
      EXPECT_EQ(sound->judgements[0].of, "held-out poses");
      EXPECT_EQ(sound->judgements[0].count, 27);
      disagreed += sound->judgements[0].agrees ? 0 : 1;
      below_half += sound->judgements[0].probability < 0.5 ? 1 : 0;
      if (seed > 20) continue;
      poses[3].centre_mm.z() += 0.01;
      ASSERT_TRUE(poses[3].held_out);
      EXPECT_FALSE(CalibrateRotation(poses, options)->judgements[0].agrees) << seed;
    }
    EXPECT_LE(disagreed, 3);
    EXPECT_NEAR(below_half, kSeeds / 2, 4 * std::sqrt(kSeeds / 4.0)) << stated_mm;  // F is what it claims to be
  }
}

// Point C claims axes that meet and stand as recorded: 7 um apart and turned by 1e-4 they do not.
TEST(PointC, ItsClaimIsJudged) {
  RotaryAxes meeting = Nominal().nominal;
  meeting.a.point_mm = meeting.b.point_mm = {26.63, 54.88, -193.322};
  for (const double stated_mm : {1e-3, 0.0}) {
    RotationOptions options = Nominal();
    options.standard_uncertainty_mm = stated_mm;
    int disagreed = 0;
    for (int seed = 1; seed <= 200; ++seed) {
      std::mt19937_64 random(seed);
      const auto sound = CalibratePointC(Poses(meeting, 1e-3, &random), options);
      ASSERT_TRUE(sound.ok()) << sound.status();
      ASSERT_EQ(sound->judgements.size(), 1u);
      EXPECT_EQ(sound->judgements[0].of, "axes that meet and stand as the record has them");
      EXPECT_EQ(sound->judgements[0].count, 5);
      disagreed += sound->judgements[0].agrees ? 0 : 1;
      if (seed > 20) continue;
      EXPECT_FALSE(CalibratePointC(Poses(Truth(), 1e-3, &random), options)->judgements[0].agrees) << seed;
    }
    EXPECT_LE(disagreed, 3);
  }
}

// Whitened by the reported covariance, with the noise stated: 200 seeds of 8 parameters scatter by sqrt(2/1600) = 0.035.
// The bound is the reported covariance itself, whose Jacobian is checked against differences below.
TEST(RotationCalibration, ReachesTheBoundWithHonestCoverage) {
  constexpr int kSeeds = 200;
  constexpr double kNoise = 1e-3;
  RotationOptions options = Nominal();
  options.standard_uncertainty_mm = kNoise;
  double pooled = 0, slowest_s = 0;
  int covered = 0;
  Eigen::Matrix<double, 8, 1> bias = Eigen::Matrix<double, 8, 1>::Zero();
  for (int seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    const std::vector<SpherePose> poses = Poses(Truth(), kNoise, &random);
    const auto start = std::chrono::steady_clock::now();
    const auto result = CalibrateRotation(poses, options);
    slowest_s = std::max(slowest_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    ASSERT_TRUE(result.ok()) << result.status();
    const Eigen::Matrix<double, 8, 1> error = ErrorOfAxes(result->axes, Truth());
    pooled += error.dot(result->covariance.ldlt().solve(error)) / 8 / kSeeds;
    for (int k = 0; k < 8; ++k) {
      const double sigma = std::sqrt(result->covariance(k, k));
      covered += std::abs(error(k)) <= 1.96 * sigma;
      bias(k) += error(k) / sigma / kSeeds;
    }
  }
  const double coverage = 100.0 * covered / (8 * kSeeds);
  std::printf("MSE over bound %.3f, 95 %% intervals cover %.1f %%, greatest bias %.2f sigma, slowest %.1f ms\n", pooled,
              coverage, bias.cwiseAbs().maxCoeff(), 1e3 * slowest_s);
  EXPECT_NEAR(pooled, 1, 0.15);
  EXPECT_GT(coverage, 93);
  EXPECT_LT(coverage, 97.5);
  // The mean of 200 scatters by 0.07 sigma.
  EXPECT_LT(bias.cwiseAbs().maxCoeff(), 0.2);
  EXPECT_LT(slowest_s, 0.05);
}

TEST(RotationCalibration, GivesTheSameBitsWhoeverElseCalls) {
  std::mt19937_64 random(5);
  const std::vector<SpherePose> poses = Poses(Truth(), 1e-3, &random);
  const auto alone = CalibrateRotation(poses, Nominal());
  absl::StatusOr<RotationCalibration> first, second;
  std::thread other([&] { first = CalibrateRotation(poses, Nominal()); });
  second = CalibrateRotation(poses, Nominal());
  other.join();
  ASSERT_TRUE(alone.ok() && first.ok() && second.ok());
  for (const auto* result : {&*first, &*second}) {
    EXPECT_EQ(result->covariance, alone->covariance);
    EXPECT_EQ(result->distances_mm, alone->distances_mm);
  }
}

// B about Y carries C about Z, on a table that X and Y move: NRC's, with axes that neither meet nor are square.
JointChain TiltRotaryTable(const AxisLine& b, const AxisLine& c) {
  std::vector<Joint> joints(4);
  const std::pair<const char*, JointMotion> motions[] = {
      {"X", {JointKind::kLinear, {Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero()}}},
      {"Y", {JointKind::kLinear, {Eigen::Vector3d::UnitY(), Eigen::Vector3d::Zero()}}},
      {"B", {JointKind::kRotary, b}},
      {"C", {JointKind::kRotary, c}}};
  for (size_t i = 0; i < 4; ++i) {
    joints[i].axis = motions[i].first;
    joints[i].motion = motions[i].second;
  }
  joints[2].minimum = -110 * kRadPerDeg;
  joints[2].maximum = 110 * kRadPerDeg;
  return *JointChain::Make(joints, {});
}

TEST(RotationCalibration, FindsTheAxesOfATiltRotaryTable) {
  const JointChain record =
      TiltRotaryTable({Eigen::Vector3d::UnitY(), {0, 0, -120}}, {Eigen::Vector3d::UnitZ(), {0, 0, 0}});
  const JointChain real = TiltRotaryTable({Eigen::Vector3d(2e-4, 1, -1e-4).normalized(), {0.02, 0, -120.03}},
                                          {Eigen::Vector3d(-1e-4, 3e-4, 1).normalized(), {0.015, -0.04, 0}});
  auto options = RotationOptions::Of(record);
  ASSERT_TRUE(options.ok()) << options.status();
  EXPECT_EQ(options->joints[0].axis, "B");
  EXPECT_EQ(options->joints[1].axis, "C");
  options->standard_uncertainty_mm = 1e-3;
  const Eigen::Vector3d sphere(45, -20, 30);
  const RotaryAxes truth = *RotaryAxes::Of(real);
  std::vector<SpherePose> poses;
  for (int b = -90; b <= 90; b += 45)
    for (int c = 0; c < 360; c += 60) {
      Eigen::VectorXd at(4);
      at << 0, 0, b * kRadPerDeg, c * kRadPerDeg;
      poses.push_back({b * kRadPerDeg, c * kRadPerDeg, real.MachineFromZero(at) * sphere, poses.size() % 5 == 4});
    }
  const auto exact = CalibrateRotation(poses, *options);
  ASSERT_TRUE(exact.ok()) << exact.status();
  EXPECT_LT(ErrorOfAxes(exact->axes, truth).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT(exact->check_rms_mm, 1e-9);
  // Both curves: the record's axes are tens of um off.
  ASSERT_EQ(exact->before_mm.size(), poses.size());
  EXPECT_GT(*std::max_element(exact->before_mm.begin(), exact->before_mm.end()), 0.02);
  EXPECT_LT(*std::max_element(exact->distances_mm.begin(), exact->distances_mm.end()), 1e-9);
  constexpr int kSeeds = 200;
  double pooled = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0, 1e-3);
    std::vector<SpherePose> noisy = poses;
    for (SpherePose& p : noisy) p.centre_mm += Eigen::Vector3d(noise(random), noise(random), noise(random));
    const auto result = CalibrateRotation(noisy, *options);
    ASSERT_TRUE(result.ok()) << result.status();
    const Eigen::Matrix<double, 8, 1> error = ErrorOfAxes(result->axes, truth);
    pooled += error.dot(result->covariance.ldlt().solve(error)) / 8 / kSeeds;
  }
  EXPECT_NEAR(pooled, 1, 0.15);
  std::vector<SpherePose> beyond = poses;
  beyond[3].a_rad = 111 * kRadPerDeg;
  const absl::Status refused = CalibrateRotation(beyond, *options).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(refused.message(), "poses[3].B: 111 deg, want -110 to 110 deg, the axis's limits");
  std::vector<SpherePose> one_c = poses;
  for (SpherePose& p : one_c) p.b_rad = 0;
  EXPECT_THAT(std::string(CalibrateRotation(one_c, *options).status().message()),
              HasSubstr("C axis is not determined"));
}

// Axes whose angle errors are known: with their tables the fit is exact, without them it is not.
TEST(RotationCalibration, TakesTheAnglesThatTheAxesReached) {
  RotationOptions with = Nominal();
  AngleTable table;
  for (int i = 0; i < 360; ++i) {
    const double error = 0.012 * kRadPerDeg * std::sin(i * kRadPerDeg);
    table.forward_rad.push_back(error + 0.0075 * kRadPerDeg);
    table.backward_rad.push_back(error - 0.0075 * kRadPerDeg);
  }
  with.joints[0].table = table;
  std::vector<SpherePose> poses = Poses(Truth(), 0, nullptr);
  for (size_t i = 0; i < poses.size(); ++i) {
    SpherePose& p = poses[i];
    p.a_travel = i % 2 == 0 ? Travel::kForward : Travel::kBackward;
    p.centre_mm = Truth().MachineFromZero(table.Reached(p.a_rad, p.a_travel), p.b_rad) * kSphere;
  }
  const auto compensated = CalibrateRotation(poses, with), plain = CalibrateRotation(poses, Nominal());
  ASSERT_TRUE(compensated.ok() && plain.ok());
  EXPECT_LT(ErrorOfAxes(compensated->axes, Truth()).cwiseAbs().maxCoeff(), 1e-9);
  // 0.0075 deg at 70 mm is 9 um.
  EXPECT_GT(plain->check_rms_mm, 3e-3);
}

TEST(RotationCalibration, StandardProcedureFindsPointCWithItsUncertainty) {
  const Eigen::Vector3d c(26.6182, 54.8481, -193.1247);
  constexpr double kNoise = 1e-3, kFace = 75;
  const auto probing = [&](std::mt19937_64* random) {
    std::normal_distribution<double> noise(0, kNoise);
    StandardProbing touched;
    touched.face_above_centre_mm = kFace;
    for (int i = 0; i < 8; ++i) {
      const double at = i * M_PI / 4, radius = 12 + noise(*random);
      touched.bore_mm.push_back(c + Eigen::Vector3d(radius * std::cos(at), radius * std::sin(at), -40));
      touched.face_mm.push_back(c + Eigen::Vector3d(5.0 * i, -3.0 * i, kFace + noise(*random)));
    }
    return touched;
  };
  RotationOptions options = Nominal();
  options.standard_uncertainty_mm = kNoise;
  constexpr int kSeeds = 200;
  double pooled = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    const auto result = CalibrateStandardCentre(probing(&random), {}, options);
    ASSERT_TRUE(result.ok()) << result.status();
    const Eigen::Vector3d error = result->point_c_mm - c;
    pooled += error.dot(result->point_c_covariance_mm2.ldlt().solve(error)) / 3 / kSeeds;
  }
  // 600 values: sqrt(2/600) = 0.06.
  EXPECT_NEAR(pooled, 1, 0.18);
  // Its error curve over poses about axes that do not meet: the lines do better.
  std::mt19937_64 random(1);
  StandardProbing touched = probing(&random);
  const std::vector<SpherePose> poses = Poses(Truth(), 0, nullptr);
  const auto standard = CalibrateStandardCentre(touched, poses, options);
  ASSERT_TRUE(standard.ok()) << standard.status();
  EXPECT_EQ(standard->check_count, static_cast<int>(poses.size()));
  EXPECT_GT(standard->check_rms_mm, 1e-3);
  const auto refused = [&](const StandardProbing& in) {
    const auto result = CalibrateStandardCentre(in, {}, options);
    return result.ok() ? "accepted" : std::string(result.status().message());
  };
  StandardProbing few = touched, arc = touched, inches = touched, nan = touched;
  few.bore_mm.resize(3);
  EXPECT_THAT(refused(few), HasSubstr("bore_mm: 3 points, want at least 4"));
  for (int i = 0; i < 8; ++i) {
    const double at = i * 2 * kRadPerDeg;
    arc.bore_mm[static_cast<size_t>(i)] = c + Eigen::Vector3d(12 * std::cos(at), 12 * std::sin(at), -40);
  }
  EXPECT_THAT(refused(arc), HasSubstr("touch the bore all round"));
  for (auto* points : {&inches.bore_mm, &inches.face_mm})
    for (Eigen::Vector3d& p : *points) p /= 25.4;
  EXPECT_THAT(refused(inches), HasSubstr("check the poses' units"));
  nan.face_mm[2].z() = std::nan("");
  EXPECT_THAT(refused(nan), HasSubstr("face_mm[2]"));
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
  const AxesCovariance bound = Eigen::Matrix<double, 11, 11>(information.inverse()).topLeftCorner<8, 8>();
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

// Against fits of the same spheres, read by linear axes that are off.
TEST(RotationCalibration, FollowsTheLinearAxesAsARefitShows) {
  RotaryAxes meeting = Truth();
  meeting.b.point_mm = meeting.a.point_mm = meeting.PointC();
  meeting.a.direction = Eigen::Vector3d::UnitY();
  meeting.b.direction = Eigen::Vector3d::UnitX();
  for (const bool point_c : {false, true}) {
    const RotaryAxes truth = point_c ? meeting : Truth();
    const auto fit = [&](const std::vector<SpherePose>& poses) {
      return point_c ? CalibratePointC(poses, Nominal()) : CalibrateRotation(poses, Nominal());
    };
    const std::vector<SpherePose> poses = Poses(truth, 0, nullptr);
    const auto result = fit(poses);
    ASSERT_TRUE(result.ok()) << result.status();
    for (int k = 0; k < kLinearParameterCount; ++k) {
      constexpr double kStep = 1e-6;
      std::vector<SpherePose> read = poses;
      for (SpherePose& pose : read) pose.centre_mm += kStep * LinearAxesJacobian(pose.centre_mm).col(k);
      const auto moved = fit(read);
      ASSERT_TRUE(moved.ok()) << moved.status();
      const Eigen::Matrix<double, 8, 1> seen = -ErrorOfAxes(result->axes, moved->axes) / kStep;
      EXPECT_LT((seen - result->linear_response.col(k)).norm(), 1e-3 * seen.norm() + 1e-3)
          << k << (point_c ? " of Point C" : "") << "\n"
          << seen.transpose() << "\n"
          << result->linear_response.col(k).transpose();
    }
    // Stretched alike, the lines are as far out as everything else.
    const Eigen::VectorXd alike = (result->linear_response - LineResponse(result->axes)).leftCols<3>().rowwise().sum();
    EXPECT_LT(alike.norm(), 1e-3 * LineResponse(result->axes).norm());
  }
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
