#include "metrology/registration/disagreement.h"

#include <gtest/gtest.h>

#include "metrology/registration/direction_words.h"
#include "metrology/registration/six_point.h"
#include "metrology/registration/size_remark.h"
#include "tests/metrology/registration/sampled_blade.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

PoseFit At(const Eigen::Isometry3d& pose, double sigma_mm,
           const PoseSensitivity& sensitivity = PoseSensitivity::Zero()) {
  PoseFit fit;
  fit.outcome = Outcome::kConverged;
  Matrix6d noise = Matrix6d::Zero();
  noise.bottomRightCorner<3, 3>() = sigma_mm * sigma_mm * Eigen::Matrix3d::Identity();
  fit.placed = PlacedPose(pose, pose * kPartCentreMm, noise, sensitivity, {});
  return fit;
}

TEST(Disagreement, IsTheGreatestDisplacementByItsUncertainty) {
  const PoseFit one = At(BladePose(), 3e-3);
  Eigen::Isometry3d moved = BladePose();
  moved.translation() += Vector3d(0, 0.025, 0);
  const PoseFit other = At(moved, 4e-3);
  const auto found = DisagreementOf(*BladeSurface(), one, other, MachineCalibration::Exact(), Matrix6d::Zero(), {});
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_NEAR(found->greatest_mm, 0.025, 1e-12);
  EXPECT_NEAR(found->standard_uncertainty_mm, 5e-3, 1e-12);
  EXPECT_NEAR(found->ratio, 5, 1e-9);
  EXPECT_TRUE(found->beyond);
  Matrix6d more = Matrix6d::Zero();
  more(4, 4) = 0.012 * 0.012;
  const auto less = DisagreementOf(*BladeSurface(), one, other, MachineCalibration::Exact(), more, {});
  EXPECT_NEAR(less->standard_uncertainty_mm, 13e-3, 1e-12);
  EXPECT_FALSE(less->beyond);
  EXPECT_EQ(DisagreementOf(*BladeSurface(), one, one, MachineCalibration::Exact(), more, {})->ratio, 0);

  // A turn about the centroid: least near it, greatest at an end.
  Vector6d turn = Vector6d::Zero();
  turn[0] = 1e-3;
  const PoseFit turned = At(Perturbed(BladePose(), turn, BladePose() * kPartCentreMm), 1e-3);
  const auto whole = DisagreementOf(*BladeSurface(), one, turned, MachineCalibration::Exact(), Matrix6d::Zero(), {});
  EXPECT_NEAR(whole->greatest_mm,
              GreatestDisplacement(*BladeSurface(), Placed(one).zero_from_part, Placed(turned).zero_from_part), 1e-12);
  FitOptions region;
  region.regions_in.push_back({Region::Shape::kBall, kPartCentreMm, Vector3d::Constant(4)});
  const auto within =
      DisagreementOf(*BladeSurface(), one, turned, MachineCalibration::Exact(), Matrix6d::Zero(), region);
  EXPECT_LT(within->greatest_mm, 5e-3);
  EXPECT_LT((within->point_mm - kPartCentreMm).norm(), 5);

  PoseFit none = one;
  none.Withdraw(Outcome::kNotConverged, "");
  EXPECT_EQ(DisagreementOf(*BladeSurface(), one, none, MachineCalibration::Exact(), more, {}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

// What both poses take from the calibrations alike is not in the difference.
TEST(Disagreement, LeavesOutWhatTheCalibrationsMoveAlike) {
  MachineCalibration calibration = MachineCalibration::Exact();
  calibration.sensor.covariance = 1e-4 * Matrix6d::Identity();
  PoseSensitivity sensitivity = PoseSensitivity::Zero();
  sensitivity.bottomRows<3>().leftCols<6>().rightCols<3>().setIdentity();
  const PoseFit one = At(BladePose(), 1e-3, sensitivity);
  Eigen::Isometry3d moved = BladePose();
  moved.translation() += Vector3d(0.02, 0, 0);
  PoseFit other = At(moved, 1e-3, sensitivity);
  const auto alike = DisagreementOf(*BladeSurface(), one, other, calibration, Matrix6d::Zero(), {});
  EXPECT_NEAR(alike->standard_uncertainty_mm, 1e-3 * std::sqrt(2), 1e-12);
  other.placed->calibration_sensitivity *= 1.5;
  const auto apart = DisagreementOf(*BladeSurface(), one, other, calibration, Matrix6d::Zero(), {});
  EXPECT_NEAR(apart->standard_uncertainty_mm, std::sqrt(2e-6 + 0.25 * 1e-4), 1e-12);
}

// A true part, its six points by their pairs: the ratio is at most the root of chi squared with six degrees of freedom, beyond
// the limit in 1 % of draws; in 40 draws more than two happens in 0.7 %. Far too wide an uncertainty would put the ratios near
// 0.
TEST(Disagreement, NoiseAloneIsSeldomFlagged) {
  std::vector<DatumPoint> datums;
  for (const Vector3d& near : {Vector3d(-4, 9, -14), Vector3d(4, 9, -14), Vector3d(0, 9, 14), Vector3d(-12, 1, -12),
                               Vector3d(-9, 1, 12), Vector3d(0, 0.5, 24)}) {
    const SurfacePoint on = BladeSurface()->Closest(kPartCentreMm + near);
    datums.push_back({"D" + std::to_string(datums.size() + 1), on.point_mm, on.normal});
  }
  int beyond = 0;
  double ratios = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const SpreadSamples samples = Spread(*BladeSurface(), 60000, 100 + seed);
    const std::vector<ScanPortion> portions = {PortionAtZero(Scanned(samples.points_mm, BladePose(), 2e-3, seed))};
    const auto best = FitToSurface(*BladeSurface(), portions, StartPose(), MachineCalibration::Exact(), {});
    ASSERT_TRUE(best.ok());
    const auto six = FitSixPoints(*BladeSurface(), portions, datums, *best, SixPointVariant::kPairs,
                                  MachineCalibration::Exact(), {});
    ASSERT_TRUE(six.ok());
    const auto found = DisagreementOf(*BladeSurface(), *six, *best, MachineCalibration::Exact(), Matrix6d::Zero(), {});
    ASSERT_TRUE(found.ok()) << found.status();
    beyond += found->beyond ? 1 : 0;
    ratios += found->ratio / 40;
  }
  RecordProperty("beyond", beyond);
  RecordProperty("mean_ratio", std::to_string(ratios));
  EXPECT_LE(beyond, 2);
  EXPECT_GT(ratios, 0.6);
  EXPECT_LT(ratios, 2);
}

TEST(DirectionInWords, NamesThePartsAxes) {
  const Eigen::Isometry3d pose = BladePose();
  const auto words = [&](const Vector3d& turn, const Vector3d& shift) {
    Vector6d direction;
    direction << pose.linear() * turn, pose.linear() * shift;
    return DirectionInWords(direction, pose);
  };
  EXPECT_EQ(words({0, 0, 0}, {0, 0.1, -1}), "shift along the part's z");
  EXPECT_EQ(words({0, 0.99, 0}, {0.1, 0, 0}), "turn about the part's y");
  EXPECT_EQ(words({0.6, 0, 0}, {0, 0, 0.8}), "shift along the part's z with a turn about the part's x");
  EXPECT_EQ(words({0, 0, 0}, {-0.6, 0, -0.8}), "shift along the part's (0.60 0.00 0.80)");
  EXPECT_EQ(words({0, 0, 0}, {0, 0, 0}), "");
}

TEST(FreeDirectionsInWords, NamesWhatAPlaneLeavesFreeAndWhatIsNotHeldAnyway) {
  const SpreadSamples cap =
      Spread(*BladeSurface(), 3000, 9, [](const SurfacePoint& on) { return on.normal.z() > 0.999; });
  const std::vector<ScanPortion> plane = {PortionAtZero(Scanned(cap.points_mm, BladePose(), 2e-3, 9))};
  FitOptions options;
  const auto all = FreeDirectionsInWords(*BladeSurface(), plane, BladePose(), 0.5, options);
  ASSERT_TRUE(all.ok());
  for (const char* direction : {"shift along the part's x", "shift along the part's y", "turn about the part's z"})
    EXPECT_NE(all->find(direction), std::string::npos) << *all;
  EXPECT_EQ(std::count(all->begin(), all->end(), ','), 2) << *all;
  options.free = {true, true, false, false, true, true};
  EXPECT_EQ(*FreeDirectionsInWords(*BladeSurface(), plane, BladePose(), 0.5, options), "shift along the part's y");
  const SpreadSamples whole = Spread(*BladeSurface(), 5000, 9);
  EXPECT_EQ(*FreeDirectionsInWords(*BladeSurface(), {PortionAtZero(Scanned(whole.points_mm, BladePose(), 2e-3, 9))},
                                   BladePose(), 0.5, {}),
            "");
}

TEST(SizeRemark, SaysWhichUnitWouldExplainTheSizes) {
  const SpreadSamples samples = Spread(*BladeSurface(), 5000, 3);
  const auto remark = [&](double scale) {
    Points points;
    for (const Vector3d& p : Scanned(samples.points_mm, BladePose(), 0, 3))
      points.push_back(BladePose() * kPartCentreMm + scale * (p - BladePose() * kPartCentreMm));
    return SizeRemark(*BladeSurface(), {PortionAtZero(points)}, StartPose());
  };
  EXPECT_EQ(remark(1), "");
  EXPECT_EQ(remark(0.4), "");  // a scan of a part of it
  EXPECT_NE(remark(25.4).find("inches and taken for millimetres"), std::string::npos) << remark(25.4);
  EXPECT_NE(remark(12).find("inches and taken for millimetres"), std::string::npos);  // half of it seen
  EXPECT_NE(remark(1 / 25.4).find("millimetres and taken for inches"), std::string::npos);
  EXPECT_NE(remark(1e-3).find("taken for metres"), std::string::npos);
  EXPECT_EQ(remark(3).find("taken for"), std::string::npos);
  EXPECT_NE(remark(3).find("times as long as the CAD"), std::string::npos);
}

}  // namespace
}  // namespace sixpoint::metrology
