#include "metrology/calibration/sensor_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstring>

#include "tests/metrology/calibration/artefact_sampler.h"

namespace sixpoint::metrology {
namespace {

using sixpoint::testing::ArtefactBench;
using ::testing::HasSubstr;

std::vector<LineScan> TwoScans(const ArtefactBench& bench, double noise_mm, std::mt19937_64* random) {
  return {bench.Scan("high", 10, noise_mm, random), bench.Scan("low", -10, noise_mm, random)};
}

Vector6d ErrorOfSensor(const SensorPose& found, const SensorPose& truth) {
  Vector6d error;
  error << VectorFromRotation(found.rotation * truth.rotation.transpose()), found.t_sm_mm - truth.t_sm_mm;
  return error;
}

SensorCalibrationOptions OptionsFor(const ArtefactBench& bench) {
  SensorCalibrationOptions options;
  options.optics = bench.optics;
  return options;
}

TEST(SensorCalibration, RecoversTheTruthExactlyWithoutNoise) {
  for (const double turn_deg : {-0.6, 20.0, -20.0}) {
    const ArtefactBench bench = ArtefactBench::Usual(turn_deg);
    const auto result =
        CalibrateSensor(TwoScans(bench, 0, nullptr), bench.artefact, bench.Touch(0, nullptr), OptionsFor(bench));
    ASSERT_TRUE(result.ok()) << turn_deg << ": " << result.status();
    EXPECT_TRUE(result->converged);
    // Rounding of 200 mm coordinates and the iteration's end, a hundredth of a nanometre and below.
    EXPECT_LT(ErrorOfSensor(result->sensor, bench.sensor).cwiseAbs().maxCoeff(), 1e-8) << turn_deg;
    for (const CentreResidual& c : result->fitted) EXPECT_LT(c.laser_minus_touch_mm.norm(), 1e-6) << c.feature;
    // A slot's edge lies between two profiles (0.1 mm) and two columns (0.07 mm).
    ASSERT_EQ(result->check.size(), 6u);
    for (const CentreResidual& c : result->check) EXPECT_LT(c.laser_minus_touch_mm.norm(), 0.05) << c.feature;
  }
}

// Slots take no part in the fit: where they stand says whether it is right, as far as their edges are seen.
TEST(SensorCalibration, SlotsAreJudged) {
  const ArtefactBench bench = ArtefactBench::Usual();
  int disagreed = 0;
  constexpr int kSeeds = 20;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    const std::vector<LineScan> scans = TwoScans(bench, bench.optics.noise_mm, &random);
    ArtefactTouch touch = bench.Touch(bench.touch_noise_mm, &random);
    const auto sound = CalibrateSensor(scans, bench.artefact, touch, OptionsFor(bench));
    ASSERT_TRUE(sound.ok() && sound->judgement.has_value()) << sound.status();
    EXPECT_EQ(sound->judgement->count, 6);
    disagreed += sound->judgement->agrees ? 0 : 1;
    if (seed > 3) continue;
    for (TouchedPoint& centre : touch.centres)
      if (centre.name == "Q2") centre.point_mm.y() += 0.15;
    const auto wrong = CalibrateSensor(scans, bench.artefact, touch, OptionsFor(bench));
    ASSERT_TRUE(wrong.ok() && wrong->judgement.has_value()) << wrong.status();
    EXPECT_FALSE(wrong->judgement->agrees) << wrong->judgement->ratio;
  }
  EXPECT_EQ(disagreed, 0);
  std::mt19937_64 random(1);
  const auto once = CalibrateSensor({bench.Scan("high", 10, 2e-3, &random)}, bench.artefact,
                                    bench.Touch(bench.touch_noise_mm, &random), OptionsFor(bench));
  if (once.ok()) {
    EXPECT_FALSE(once->judgement.has_value());  // of one scan nobody knows how well it sees an edge
  }
}

// Pooled over parameters and seeds: mean squared error, whitened by the bound, is 1 for an efficient estimate. 24 seeds of
// 6 parameters scatter by sqrt(2 / 144) = 0.12; 1.4 is more than three of that.
TEST(SensorCalibration, ReachesTheCramerRaoBoundAndReportsIt) {
  const ArtefactBench bench = ArtefactBench::Usual();
  const Matrix6d bound = bench.CramerRaoBound();
  const Eigen::LLT<Matrix6d> whiten(bound);
  constexpr int kSeeds = 24;
  double pooled = 0, reported = 0;
  int covered = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    const std::vector<LineScan> scans = TwoScans(bench, bench.optics.noise_mm, &random);
    const auto result =
        CalibrateSensor(scans, bench.artefact, bench.Touch(bench.touch_noise_mm, &random), OptionsFor(bench));
    ASSERT_TRUE(result.ok()) << result.status();
    const Vector6d error = ErrorOfSensor(result->sensor, bench.sensor);
    pooled += whiten.matrixL().solve(error).squaredNorm() / 6 / kSeeds;
    reported += result->sensor.covariance.diagonal().cwiseQuotient(bound.diagonal()).mean() / kSeeds;
    for (int k = 0; k < 6; ++k) covered += std::abs(error(k)) <= 1.96 * std::sqrt(result->sensor.covariance(k, k));
    EXPECT_NEAR(result->noise_mm, bench.optics.noise_mm, 0.02 * bench.optics.noise_mm);
  }
  const double coverage = 100.0 * covered / (6 * kSeeds);
  RecordProperty("variance_over_bound", std::to_string(pooled));
  std::printf("variance over bound %.3f, reported over bound %.3f, 95 %% intervals cover %.1f %%\n", pooled, reported,
              coverage);
  EXPECT_LT(pooled, 1.4);
  EXPECT_GT(pooled, 0.6);
  EXPECT_LT(reported, 1.15);
  EXPECT_GT(reported, 0.9);
  EXPECT_GT(coverage, 88);
}

// The answer to a scanner's field: what a calibration from scans with it differs by from one without.
TEST(SensorCalibration, FollowsTheScannersFieldAsItSays) {
  const ArtefactBench bench = ArtefactBench::Usual();
  std::mt19937_64 random(12);
  SensorCalibrationOptions options = OptionsFor(bench);
  options.field = ScannerField::Of(66, 25, 20 * M_PI / 180);
  const std::vector<LineScan> scans = TwoScans(bench, bench.optics.noise_mm, &random);
  const ArtefactTouch touch = bench.Touch(bench.touch_noise_mm, &random);
  const auto without = CalibrateSensor(scans, bench.artefact, touch, options);
  ASSERT_TRUE(without.ok()) << without.status();
  ASSERT_TRUE(without->field_response.has_value());
  const Vector6d sigma = without->sensor.covariance.diagonal().cwiseSqrt();
  for (int k = 0; k < kFieldParameterCount; ++k) {
    constexpr double kStep_mm = 2e-4;
    std::vector<LineScan> moved = scans;
    for (LineScan& scan : moved)
      for (Eigen::Vector3d& p : scan.points_mm) p.z() += kStep_mm * options.field.TermsAt(p.y(), p.z())[k];
    const auto with = CalibrateSensor(moved, bench.artefact, touch, options);
    ASSERT_TRUE(with.ok()) << with.status();
    const Vector6d change = ErrorOfSensor(with->sensor, without->sensor);
    const Vector6d stated = kStep_mm * without->field_response->col(k);
    const Vector6d off = (change - stated).cwiseQuotient(sigma);
    // Points at the gate come and go: a tenth of the calibration's own uncertainty.
    EXPECT_LT(off.norm(), 0.05 * change.cwiseQuotient(sigma).norm() + 0.1) << kFieldParameters[k].name;
  }
  options.field = {};
  EXPECT_FALSE(CalibrateSensor(scans, bench.artefact, touch, options)->field_response.has_value());
}

TEST(SensorCalibration, GivesTheSameBitsOnOneAndTwoThreads) {
  const ArtefactBench bench = ArtefactBench::Usual();
  std::mt19937_64 random(7);
  const std::vector<LineScan> scans = TwoScans(bench, 2e-3, &random);
  const ArtefactTouch touch = bench.Touch(6e-4, &random);
  SensorCalibrationOptions options = OptionsFor(bench);
  const auto one = CalibrateSensor(scans, bench.artefact, touch, options);
  options.threads = 2;
  const auto two = CalibrateSensor(scans, bench.artefact, touch, options);
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_EQ(0, std::memcmp(one->sensor.rotation.data(), two->sensor.rotation.data(), sizeof(Eigen::Matrix3d)));
  EXPECT_EQ(0, std::memcmp(one->sensor.t_sm_mm.data(), two->sensor.t_sm_mm.data(), sizeof(Eigen::Vector3d)));
  EXPECT_EQ(0, std::memcmp(one->sensor.covariance.data(), two->sensor.covariance.data(), sizeof(Matrix6d)));
}

TEST(SensorCalibration, IsNotMovedByStrayReturnsAndGaps) {
  const ArtefactBench bench = ArtefactBench::Usual();
  std::mt19937_64 random(11);
  std::vector<LineScan> scans = TwoScans(bench, 2e-3, &random);
  const ArtefactTouch touch = bench.Touch(6e-4, &random);
  const auto clean = CalibrateSensor(scans, bench.artefact, touch, OptionsFor(bench));
  std::uniform_real_distribution<double> even(0, 1);
  for (LineScan& scan : scans) {
    Points kept;
    for (Eigen::Vector3d p : scan.points_mm) {
      if (even(random) < 0.25) continue;                           // missing
      if (even(random) < 0.01) p.z() += (even(random) - 0.5) * 4;  // reflections
      kept.push_back(p);
    }
    scan.points_mm = kept;
  }
  const auto dirty = CalibrateSensor(scans, bench.artefact, touch, OptionsFor(bench));
  ASSERT_TRUE(clean.ok()) << clean.status();
  ASSERT_TRUE(dirty.ok()) << dirty.status();
  const Vector6d moved = ErrorOfSensor(dirty->sensor, clean->sensor);
  // An estimate from 3/4 of the readings differs by sqrt(4/3 - 1) = 0.58 standard deviations; three of those.
  for (int k = 0; k < 6; ++k) EXPECT_LT(std::abs(moved(k)), 1.75 * std::sqrt(clean->sensor.covariance(k, k))) << k;
}

TEST(SensorCalibration, SequentialAgreesWithTheTruthWithinItsUncertainty) {
  const ArtefactBench bench = ArtefactBench::Usual();
  const auto exact = CalibrateSensorSequentially(TwoScans(bench, 0, nullptr), bench.artefact, bench.Touch(0, nullptr),
                                                 OptionsFor(bench));
  ASSERT_TRUE(exact.ok()) << exact.status();
  // The paper's angles are plane angles of one line: exact up to products of small angles (0.5 deg squared is 8e-5 rad).
  EXPECT_LT(ErrorOfSensor(exact->sensor, bench.sensor).head<3>().norm(), 8e-5);
  std::mt19937_64 random(3);
  const auto noisy = CalibrateSensorSequentially(TwoScans(bench, 2e-3, &random), bench.artefact,
                                                 bench.Touch(bench.touch_noise_mm, &random), OptionsFor(bench));
  ASSERT_TRUE(noisy.ok()) << noisy.status();
  const Vector6d error = ErrorOfSensor(noisy->sensor, bench.sensor);
  for (int k = 0; k < 6; ++k) EXPECT_LT(std::abs(error(k)), 4 * std::sqrt(noisy->sensor.covariance(k, k)) + 1e-5) << k;
}

// ADR 9; 32 degrees of freedom of 0.5 um each.
TEST(SensorCalibration, ResidualsOnlyRaiseTheTouchUncertaintyAndSayHowWellItIsKnown) {
  constexpr double kSquares = 32 * 0.25e-6;
  const auto noise = [](double stated_mm, double squares) {
    ArtefactTouch touch;
    touch.standard_uncertainty_mm = stated_mm;
    return TouchNoise(touch, squares, 32);
  };
  EXPECT_EQ(noise(0, kSquares).standard_uncertainty_mm, kTouchUncertaintyMm);
  EXPECT_EQ(noise(0.6e-3, kSquares).standard_uncertainty_mm, 0.6e-3);
  EXPECT_TRUE(std::isinf(noise(1e-3, kSquares).degrees_of_freedom));
  // However little more they show: one and a half times what was stated was once let pass, and 95 % covered 81 %.
  EXPECT_NEAR(noise(0.45e-3, kSquares).standard_uncertainty_mm, 0.5e-3, 1e-12);
  EXPECT_NEAR(noise(1e-3, 16 * kSquares).standard_uncertainty_mm, 2e-3, 1e-12);
  EXPECT_EQ(noise(1e-3, 16 * kSquares).degrees_of_freedom, 32);
}

class Refusals : public ::testing::Test {
 protected:
  Refusals()
      : bench(ArtefactBench::Usual()),
        random(5),
        scans(TwoScans(bench, 2e-3, &random)),
        touch(bench.Touch(6e-4, &random)) {}
  std::string Refused() {
    const auto result = CalibrateSensor(scans, bench.artefact, touch, OptionsFor(bench));
    return result.ok() ? "accepted" : std::string(result.status().message());
  }
  ArtefactBench bench;
  std::mt19937_64 random;
  std::vector<LineScan> scans;
  ArtefactTouch touch;
};

TEST_F(Refusals, OneScanOnly) {
  scans.pop_back();
  EXPECT_THAT(Refused(), HasSubstr("beta (turn about machine Y) is not determined"));
}
TEST_F(Refusals, BothScansAtOneHeight) {
  scans[1] = bench.Scan("again", 10, 2e-3, &random);
  EXPECT_THAT(Refused(), ::testing::AllOf(HasSubstr("beta"), HasSubstr("add a scan with machine Z at least 5 mm away"),
                                          HasSubstr("condition number")));
}
TEST_F(Refusals, ConesAlongOneLineOfTheScan) {
  bench = ArtefactBench::Usual(0);
  bench.artefact.cones = {{"C1", {-7, 0}}, {"C2", {0, 1.2}}, {"C3", {7, 0}}};
  bench.artefact.slots = {{"Q1", {-3.5, 6.5}}, {"Q2", {-3.5, -6.5}}};
  scans = TwoScans(bench, 2e-3, &random);
  touch = bench.Touch(6e-4, &random);
  EXPECT_THAT(Refused(), ::testing::AllOf(HasSubstr("gamma (turn about machine Z) is not determined"),
                                          HasSubstr("condition number"), HasSubstr("turn the artefact")));
}
TEST_F(Refusals, PoorTouchDataNamingWhatTheyLeaveUndetermined) {
  touch.standard_uncertainty_mm = 0.05;  // 3 cones alone hold x to 50 um / sqrt 3; with six points of a side, 50 um / 3
  touch.side_x_mm.clear();
  EXPECT_THAT(Refused(), ::testing::AllOf(HasSubstr("not determined"), HasSubstr("T_sm x"),
                                          ::testing::Not(HasSubstr("T_sm y")), ::testing::Not(HasSubstr("T_sm z")),
                                          HasSubstr("condition number"), HasSubstr("more points")));
}
TEST_F(Refusals, TwoConesOnly) {
  bench.artefact.cones.pop_back();
  EXPECT_THAT(Refused(), HasSubstr("artefact.cones: 2 of them, want 3 to 16"));
}
TEST_F(Refusals, AnotherArtefactsRecord) {
  for (PlaneFeature& cone : bench.artefact.cones) cone.centre_mm *= 8.0 / 7;
  EXPECT_THAT(Refused(), HasSubstr("want the distances of the artefact's record within 0.1 mm"));
}
TEST_F(Refusals, TouchDataTooLargeByAnInch) {
  for (TouchedPoint& t : touch.centres) t.point_mm *= 25.4;
  EXPECT_THAT(Refused(), ::testing::AllOf(HasSubstr("by a factor of 25."), HasSubstr("send millimetres")));
}
TEST_F(Refusals, TouchDataInInches) {
  for (TouchedPoint& t : touch.centres) t.point_mm /= 25.4;
  EXPECT_THAT(Refused(), HasSubstr("send millimetres"));
}
TEST_F(Refusals, NotANumber) {
  touch.plane_mm[3].z() = std::nan("");
  EXPECT_THAT(Refused(), HasSubstr("touch.plane_mm"));
}
TEST_F(Refusals, ConeNotTouched) {
  touch.centres.erase(touch.centres.begin() + 1);
  EXPECT_THAT(Refused(), HasSubstr("no C2"));
}
TEST_F(Refusals, ConeHidden) {
  const Eigen::Vector3d c2 = bench.machine_from_artefact * Eigen::Vector3d(3.5, 3.5, 0);
  Points kept;
  for (const Eigen::Vector3d& p : scans[1].points_mm)
    if ((bench.sensor.MachineFromSensor(p, scans[1].v0_mm) - c2).head<2>().norm() > 2.2) kept.push_back(p);
  scans[1].points_mm = kept;
  EXPECT_THAT(Refused(), ::testing::AllOf(HasSubstr("scan low: cone C2 not found"), HasSubstr("uncover it")));
}
TEST_F(Refusals, AnotherArtefact) {
  bench.artefact.cones[0].centre_mm.x() = -4.5;
  touch = bench.Touch(6e-4, &random);
  EXPECT_THAT(Refused(), HasSubstr("cone C1 not found"));
}
TEST_F(Refusals, AnotherConeAngle) {
  bench.artefact.cone_half_angle_rad = 40 * M_PI / 180;
  EXPECT_THAT(Refused(), HasSubstr("agree with the artefact's record"));
}
TEST_F(Refusals, AnotherMachinesScan) {
  scans[1].v0_mm.y() += 3;
  EXPECT_THAT(Refused(), HasSubstr("contradict one another"));
}
TEST_F(Refusals, CollinearCones) {
  bench.artefact.cones = {{"C1", {-7, 0}}, {"C2", {0, 0}}, {"C3", {7, 0}}};
  bench.artefact.slots.clear();
  EXPECT_THAT(Refused(), HasSubstr("collinear"));
}
TEST_F(Refusals, NothingOfAnArtefact) {
  scans[0].points_mm.assign(5000, Eigen::Vector3d(0, 0, 0));
  EXPECT_THAT(Refused(), HasSubstr("scan high"));
}
TEST_F(Refusals, StopsWhenTheCallerIsGone) {
  SensorCalibrationOptions options = OptionsFor(bench);
  options.keep_going = [] { return false; };
  EXPECT_EQ(CalibrateSensor(scans, bench.artefact, touch, options).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace sixpoint::metrology
