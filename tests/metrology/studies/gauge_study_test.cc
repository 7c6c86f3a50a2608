#include "metrology/studies/gauge_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

// Superposed scans of a strip that is inclined by 2 deg along the line and 0.5 deg along the encoder: 8 mm x 1 mm.
std::vector<LineScan> Strip(int count, double sigma_mm, unsigned seed, double drift_mm = 0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, sigma_mm);
  std::vector<LineScan> scans;
  for (int s = 0; s < count; ++s) {
    LineScan& scan = scans.emplace_back();
    scan.id = "s" + std::to_string(s);
    for (int i = 0; i < 10; ++i)
      for (int j = 0; j < 160; ++j) {
        const double x = 0.1 * i + 0.05, y = 0.05 * j + 0.01;
        scan.points_mm.emplace_back(x, y, 3 + 0.035 * y + 0.009 * x + drift_mm * s / (count - 1) + noise(random));
      }
  }
  return scans;
}

// Half of the range of 70 normal values is 2.36 sigma (d2(70) = 4.71).
constexpr double kHalfRange70 = 2.36;

TEST(GaugeStudy, AcceptsTheSensorOfTwoMicrometres) {
  GaugeStudyOptions options;
  options.limit_um = 3;
  const auto study = StudyGauge(Strip(70, 2e-3 / kHalfRange70, 1), options);
  ASSERT_TRUE(study.ok()) << study.status();
  EXPECT_EQ(study->scan_count, 70);
  EXPECT_GT(study->stations.size(), 600u);
  EXPECT_NEAR(study->median_oscillation_mm, 2e-3, 0.05e-3);
  EXPECT_NEAR(study->standard_deviation_mm, 2e-3 / kHalfRange70, 4 * study->standard_deviation_standard_uncertainty_mm);
  EXPECT_LT(std::abs(study->drift_mm), 4 * study->drift_standard_uncertainty_mm);
  EXPECT_EQ(study->verdict, StudyVerdict::kAccepted);
}

TEST(GaugeStudy, RejectsTheProjectorOfTwentyThreeMicrometres) {
  GaugeStudyOptions options;
  options.limit_um = 3;
  const auto study = StudyGauge(Strip(70, 23e-3 / kHalfRange70, 2), options);
  ASSERT_TRUE(study.ok()) << study.status();
  EXPECT_NEAR(study->median_oscillation_mm, 23e-3, 0.5e-3);
  EXPECT_EQ(study->verdict, StudyVerdict::kRejected);
}

TEST(GaugeStudy, HowTheSensorIsMountedIsNotItsNoise) {
  // Exact readings on an inclined strip, each scan shifted by up to half a pitch: the slope alone would be 1.7 um.
  std::vector<LineScan> scans = Strip(12, 0, 3);
  for (std::size_t s = 0; s < scans.size(); ++s)
    for (Eigen::Vector3d& p : scans[s].points_mm) {
      const double shift = 0.004 * static_cast<double>(s);
      p += Eigen::Vector3d(0, shift, 0.035 * shift);
    }
  const auto study = StudyGauge(scans, {});
  ASSERT_TRUE(study.ok()) << study.status();
  EXPECT_LT(study->greatest_oscillation_mm, 1e-9);
  EXPECT_EQ(study->verdict, StudyVerdict::kReported);
}

TEST(GaugeStudy, SeesAWarmingSensorDrift) {
  const auto study = StudyGauge(Strip(40, 1e-3, 4, 5e-3), {});
  ASSERT_TRUE(study.ok());
  EXPECT_NEAR(study->drift_mm, 5e-3, 4 * study->drift_standard_uncertainty_mm);
  EXPECT_LT(study->drift_standard_uncertainty_mm, 0.1e-3);
}

TEST(GaugeStudy, RefusesWhatIsNoGaugeStudy) {
  EXPECT_THAT(std::string(StudyGauge(Strip(9, 1e-3, 5), {}).status().message()),
              HasSubstr("scans: 9 of them, want at least 10"));
  std::vector<LineScan> scans = Strip(10, 1e-3, 6);
  scans[3].points_mm[5].z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(std::string(StudyGauge(scans, {}).status().message()), HasSubstr("not finite"));
  GaugeStudyOptions fine;
  fine.station_pitch_mm = 0.001;
  EXPECT_THAT(std::string(StudyGauge(Strip(10, 1e-3, 7), fine).status().message()),
              HasSubstr("at most 10000 stations"));
  scans = Strip(10, 1e-3, 8);
  for (LineScan& scan : scans)
    for (Eigen::Vector3d& p : scan.points_mm)
      if (p.y() > 4) p.z() -= 1;  // a slot
  EXPECT_THAT(std::string(StudyGauge(scans, {}).status().message()), HasSubstr("want a flat face"));
  scans = Strip(10, 1e-3, 9);
  for (Eigen::Vector3d& p : scans[4].points_mm) p.y() += 100;
  EXPECT_EQ(StudyGauge(scans, {}).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace sixpoint::metrology
