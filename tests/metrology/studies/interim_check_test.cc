#include "metrology/studies/interim_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "metrology/frames/angles.h"
#include "metrology/statistics/distributions.h"
#include "tests/metrology/calibration/artefact_sampler.h"

namespace sixpoint::metrology {
namespace {

using sixpoint::testing::ArtefactBench;
using ::testing::HasSubstr;

SensorPose Knocked(const SensorPose& sensor, const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm) {
  SensorPose knocked = sensor;
  knocked.rotation = RotationFromVector(turn_rad) * sensor.rotation;
  knocked.t_sm_mm += shift_mm;
  return knocked;
}

// Scans of an artefact that stands still, by a sensor that does not.
class ScannedArtefact : public ::testing::Test {
 protected:
  ScannedArtefact() { bench_.sensor.field = ScannerField::Of(bench_.optics.mid_range_mm, 25, 20 * kRadPerDeg); }

  // The calibration's own scan at that height of the field.
  void AddReference(double z_sensor_mm, const std::string& series = "s") {
    const LineScan scan = bench_.Scan("reference", z_sensor_mm, 2e-3, &random_);
    const auto artefact = FitArtefactPose(scan, bench_.artefact, bench_.optics, bench_.sensor);
    ASSERT_TRUE(artefact.ok()) << artefact.status();
    stands_.push_back(artefact->machine_from_artefact);
    const auto fit = FitSensorPose(scan, bench_.artefact, bench_.optics, bench_.sensor, stands_.back());
    ASSERT_TRUE(fit.ok()) << fit.status();
    references_.push_back({series, *fit});
  }
  CheckedScan Scan(const SensorPose& by, std::size_t reference, double z_sensor_mm, const std::string& series) {
    ArtefactBench bench = bench_;
    bench.sensor = by;
    const LineScan scan = bench.Scan("check", z_sensor_mm, 2e-3, &random_);
    const auto fit = FitSensorPose(scan, bench.artefact, bench.optics, bench_.sensor, stands_[reference]);
    EXPECT_TRUE(fit.ok()) << fit.status();
    return {scan_count_++, series, reference, fit.value_or(ArtefactFit())};
  }
  InterimCheck Check(const std::vector<CheckedScan>& scans, const InterimCheckOptions& options) {
    const auto check = CheckInterim(scans, references_, options);
    EXPECT_TRUE(check.ok()) << check.status();
    return check.value_or(InterimCheck());
  }

  ArtefactBench bench_ = ArtefactBench::Usual();
  std::mt19937_64 random_{11};
  std::vector<ReferenceScan> references_;
  std::size_t scan_count_ = 0;
  std::vector<Eigen::Isometry3d> stands_;
};

TEST_F(ScannedArtefact, AShiftIsFoundAndJudgedByItsLimit) {
  AddReference(10);
  AddReference(-10);
  InterimCheckOptions options;
  options.field_covariance_mm2.setZero();
  options.limit_mm = 0.02;
  const auto check = [&](const Eigen::Vector3d& shift_mm) {
    const SensorPose now = Knocked(bench_.sensor, Eigen::Vector3d::Zero(), shift_mm);
    return Check({Scan(now, 0, 10, "s"), Scan(now, 1, -10, "s")}, options);
  };
  const InterimCheck still = check(Eigen::Vector3d::Zero());
  EXPECT_EQ(still.verdict, StudyVerdict::kAccepted);
  EXPECT_EQ(still.swing_count, 0);
  EXPECT_LT(still.places[0].distance_mm, 3 * still.places[0].upper_mm);
  EXPECT_LT(still.places[0].upper_mm, 1e-3);
  ASSERT_EQ(still.places.size(), 5u);
  EXPECT_EQ(still.places[4].y_mm, bench_.sensor.field.half_width_mm);
  EXPECT_EQ(still.places[4].z_mm, 12.5);

  const Eigen::Vector3d shift = 0.025 * Eigen::Vector3d(1, -2, 2) / 3;
  const InterimCheck knocked = check(shift);
  EXPECT_EQ(knocked.verdict, StudyVerdict::kRejected);
  EXPECT_LT((knocked.translation_mm - shift).norm(), 1e-3);
  EXPECT_LT((knocked.places[0].displacement_mm - shift).norm(), 1e-3);
  EXPECT_EQ(check(0.6 * shift).verdict, StudyVerdict::kAccepted);
  // 20 um to the half of the bound: neither can be said.
  EXPECT_EQ(check(0.8 * shift).verdict, StudyVerdict::kUndecidable);
  options.limit_mm = 0;
  EXPECT_EQ(check(shift).verdict, StudyVerdict::kReported);
}

// One height of a plate with cones hardly shows a turn about Y; two do. What is turned about the middle of the field moves its corners.
TEST_F(ScannedArtefact, ATurnIsFoundAtTheCornersAndBetterFromTwoHeights) {
  AddReference(10);
  AddReference(-10);
  InterimCheckOptions options;
  options.field_covariance_mm2.setZero();
  options.limit_mm = 0.02;
  const Eigen::Vector3d turn(0, 0.12 * kRadPerDeg, 0);
  const SensorPose now = Knocked(bench_.sensor, turn, Eigen::Vector3d::Zero());
  const CheckedScan high = Scan(now, 0, 10, "s"), low = Scan(now, 1, -10, "s");
  const InterimCheck both = Check({high, low}, options), one = Check({high}, options);
  EXPECT_NEAR(both.angles.beta, turn.y(), 4 * std::sqrt(both.covariance(1, 1)));
  EXPECT_LT(both.covariance(1, 1), one.covariance(1, 1) / 25);
  EXPECT_EQ(both.verdict, StudyVerdict::kRejected);
  EXPECT_NE(both.worst, 0u);
  EXPECT_NEAR(both.places[both.worst].distance_mm, turn.y() * 12.5, 2e-3);
  EXPECT_LT(both.places[0].distance_mm, 1e-3);
}

// Of k swings the mean, less that of the calibration's m: 1 / k + 1 / m of the arm's spread, and nothing of where it stood in both.
TEST_F(ScannedArtefact, TheArmsSpreadIsInTheBoundAsOftenAsItWasSwung) {
  AddReference(0, "s0");
  InterimCheckOptions options;
  options.field_covariance_mm2.setZero();
  ArmSpread arm;
  arm.covariance.setZero();
  arm.covariance.diagonal() << 1e-12, 1e-12, 1e-12, 25e-6, 25e-6, 25e-6;
  arm.degrees_of_freedom = 14;
  options.arm = arm;
  const auto scan = [&](const std::string& series, std::size_t reference = 0) {
    return Scan(bench_.sensor, reference, 0, series);
  };
  const auto swung = [&](const std::vector<CheckedScan>& scans) { return Check(scans, options); };
  const auto variance = [](const InterimCheck& check) { return check.covariance(5, 5) / 25e-6; };
  EXPECT_LT(variance(swung({scan("s0")})), 0.01);
  const InterimCheck once = swung({scan("s1")});
  EXPECT_NEAR(variance(once), 2, 0.01);
  EXPECT_NEAR(once.places[0].upper_mm, StudentQuantile(0.95, 14) * 5e-3 * std::sqrt(2.0), 2e-4);
  EXPECT_NEAR(variance(swung({scan("s1"), scan("s1")})), 2, 0.01);  // of one swing
  EXPECT_NEAR(variance(swung({scan(""), scan("")})), 2, 0.01);      // nobody says that it was swung between
  const InterimCheck twice = swung({scan("s1"), scan("s2")});
  EXPECT_NEAR(variance(twice), 1.5, 0.01);
  EXPECT_EQ(twice.swing_count, 2);
  EXPECT_NEAR(variance(swung({scan("s0"), scan("s1")})), 0.5, 0.01);  // the half of one difference
  AddReference(0, "s9");
  const auto beside_both = [&](const std::vector<std::string>& series) {
    std::vector<CheckedScan> pairs;
    for (const std::string& one : series)
      for (const std::size_t reference : {std::size_t{0}, std::size_t{1}}) {
        pairs.push_back(scan(one, reference));
        pairs.back().scan -= reference;  // the same scan
      }
    return swung(pairs);
  };
  EXPECT_NEAR(variance(beside_both({"s1"})), 1.5, 0.01);
  EXPECT_NEAR(variance(beside_both({"s1", "s2"})), 1, 0.01);
  EXPECT_NEAR(variance(beside_both({"s0", "s1"})), 0.5, 0.01);
  EXPECT_LT(variance(beside_both({"s0", "s9"})), 0.01);
  EXPECT_THAT(std::string(CheckInterim({scan("s1"), scan("s2", 1)}, references_, options).status().message()),
              HasSubstr("scans.reference: 2 pairs of series, want 4"));
  references_[0].arm_series = "";
  EXPECT_NEAR(variance(swung({scan("")})), 2, 0.01);  // two that nobody knows are two
}

// What the scanner's field does to both scans alike cancels; at another height it does not.
TEST_F(ScannedArtefact, TheFieldCancelsWhereTheArtefactStandsAsItDid) {
  AddReference(8);
  InterimCheckOptions options;
  options.field_covariance_mm2.setZero();
  const CheckedScan here = Scan(bench_.sensor, 0, 8, "s"), elsewhere = Scan(bench_.sensor, 0, -8, "s");
  const double without_mm = Check({here}, options).places[0].upper_mm;
  const double without_elsewhere_mm = Check({elsewhere}, options).places[0].upper_mm;
  options.field_covariance_mm2 = FieldCovarianceOf(6e-3, std::nullopt);
  EXPECT_LT(Check({here}, options).places[0].upper_mm, without_mm + 2e-4);
  EXPECT_GT(Check({elsewhere}, options).places[0].upper_mm, without_elsewhere_mm + 2e-3);
}

// A field that is really there, by the fit's own response to it.
TEST_F(ScannedArtefact, TheFieldsResponseIsWhatAFieldDoes) {
  AddReference(8);
  LineScan scan = bench_.Scan("check", 8, 0, &random_);
  const auto fit = [&] { return *FitSensorPose(scan, bench_.artefact, bench_.optics, bench_.sensor, stands_[0]); };
  const ArtefactFit before = fit();
  constexpr double kTerm_mm = 2e-3;
  for (Eigen::Vector3d& p : scan.points_mm) p.z() += kTerm_mm * bench_.sensor.field.TermsAt(p.y(), p.z())(2);
  const ArtefactFit after = fit();
  const Eigen::Vector3d moved = after.sensor.t_sm_mm - before.sensor.t_sm_mm;
  const Eigen::Vector3d said = kTerm_mm * before.field_response.block<3, 1>(3, 2);
  EXPECT_GT(moved.norm(), 1e-4);
  EXPECT_LT((moved - said).norm(), 0.1 * moved.norm());
}

TEST_F(ScannedArtefact, WhatSaysNothingIsRefused) {
  const auto message = [&](const std::vector<CheckedScan>& scans) {
    return std::string(CheckInterim(scans, references_, {}).status().message());
  };
  EXPECT_THAT(message({}), HasSubstr("scans: none, want one or more"));
  EXPECT_THAT(message({CheckedScan()}), HasSubstr("scans.reference: 0, want less than 0"));
  AddReference(0);
  EXPECT_THAT(message({CheckedScan()}), HasSubstr("scans.fit: not finite, or certain"));
  CheckedScan scan{0, "s", 0, references_[0].fit};
  references_[0].fit.sensor.field = {};
  EXPECT_THAT(message({scan}), HasSubstr("sensor.field: none"));
}

}  // namespace
}  // namespace sixpoint::metrology
