#include "metrology/registration/six_point.h"

#include <gtest/gtest.h>

#include "tests/metrology/registration/sampled_blade.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// Three datums on one side, two on an edge's flank, one on the end: a nest that holds the blade.
std::vector<DatumPoint> Nest() {
  std::vector<DatumPoint> datums;
  const std::vector<Vector3d> near = {{-4, 9, -14}, {4, 9, -14}, {0, 9, 14}, {-12, 1, -12}, {-9, 1, 12}, {0, 0.5, 24}};
  for (std::size_t i = 0; i < near.size(); ++i) {
    const SurfacePoint on = BladeSurface()->Closest(kPartCentreMm + near[i]);
    datums.push_back({"D" + std::to_string(i + 1), on.point_mm, on.normal});
  }
  return datums;
}

struct FittedScan {
  std::vector<ScanPortion> portions;
  PoseFit best_fit;
};

FittedScan FitScan(const SpreadSamples& samples, double noise_mm) {
  FittedScan registered;
  registered.portions = {PortionAtZero(Scanned(samples.points_mm, BladePose(), noise_mm, 21))};
  auto fit = FitToSurface(*BladeSurface(), registered.portions, StartPose(), MachineCalibration::Exact(), {});
  EXPECT_TRUE(fit.ok()) << fit.status();
  registered.best_fit = *fit;
  return registered;
}

TEST(SixPoint, KeepsThePoseOfATruePart) {
  const FittedScan registered = FitScan(Spread(*BladeSurface(), 150000, 20), 2e-3);
  for (const SixPointVariant variant : {SixPointVariant::kPairs, SixPointVariant::kNormals}) {
    const auto fit = FitSixPoints(*BladeSurface(), registered.portions, Nest(), registered.best_fit, variant,
                                  MachineCalibration::Exact(), {});
    ASSERT_TRUE(fit.ok()) << fit.status();
    ASSERT_EQ(fit->outcome, Outcome::kConverged) << fit->evidence.remark;
    // Each local fit is good to about 0.5 um (60 points and more); the nest multiplies by its condition.
    const double bound_um = variant == SixPointVariant::kPairs ? 3 : 2 * fit->evidence.condition_number;
    EXPECT_LT(1e3 * GreatestDisplacement(*BladeSurface(), Placed(*fit).zero_from_part, BladePose()), bound_um);
    for (const DatumDistance& datum : fit->evidence.datums)
      EXPECT_LT(std::abs(datum.distance_mm), 5 * datum.standard_uncertainty_mm + 1e-4) << datum.name;
  }
}

// A part that is 50 um too thick on one side only: along the normals the pose must take all six distances to zero.
TEST(SixPoint, NormalsTakeEveryDistanceToZero) {
  SpreadSamples samples = Spread(*BladeSurface(), 150000, 22);
  for (std::size_t i = 0; i < samples.points_mm.size(); ++i)
    if (samples.normals[i].y() > 0) samples.points_mm[i] += 0.05 * samples.normals[i];
  const FittedScan registered = FitScan(samples, 0);
  ASSERT_EQ(registered.best_fit.outcome, Outcome::kConverged);
  const auto fit = FitSixPoints(*BladeSurface(), registered.portions, Nest(), registered.best_fit,
                                SixPointVariant::kNormals, MachineCalibration::Exact(), {});
  ASSERT_TRUE(fit.ok());
  ASSERT_EQ(fit->outcome, Outcome::kConverged) << fit->evidence.remark;
  double before = 0;
  for (const DatumDistance& datum : fit->evidence.datums) before = std::max(before, std::abs(datum.distance_mm));
  EXPECT_GT(before, 0.01);
  const auto again = FitSixPoints(*BladeSurface(), registered.portions, Nest(), *fit, SixPointVariant::kNormals,
                                  MachineCalibration::Exact(), {});
  ASSERT_TRUE(again.ok());
  for (const DatumDistance& datum : again->evidence.datums) EXPECT_LT(std::abs(datum.distance_mm), 2e-4) << datum.name;
}

TEST(SixPoint, RefusesADegenerateNest) {
  const FittedScan registered = FitScan(Spread(*BladeSurface(), 60000, 23), 0);
  std::vector<DatumPoint> datums = Nest();
  for (int i = 0; i < 6; ++i) {  // all on the end face: three directions stay free
    const SurfacePoint on =
        BladeSurface()->Closest(kPartCentreMm + Vector3d(-2.5 + i, 0.3 * (-2.5 + i) + 0.5 * (i % 2), 24));
    datums[i] = {"D" + std::to_string(i + 1), on.point_mm, on.normal};
  }
  const auto fit = FitSixPoints(*BladeSurface(), registered.portions, datums, registered.best_fit,
                                SixPointVariant::kNormals, MachineCalibration::Exact(), {});
  ASSERT_TRUE(fit.ok()) << fit.status();
  EXPECT_EQ(fit->outcome, Outcome::kNotDetermined);
  EXPECT_GT(fit->evidence.condition_number, 2000);
}

TEST(SixPoint, SaysWhichDatumHasNoPoints) {
  const FittedScan registered =
      FitScan(Spread(*BladeSurface(), 60000, 24,
                     [](const SurfacePoint& on) { return on.point_mm.z() < kPartCentreMm.z() + 10; }),
              0);
  ASSERT_EQ(registered.best_fit.outcome, Outcome::kConverged);
  const auto fit = FitSixPoints(*BladeSurface(), registered.portions, Nest(), registered.best_fit,
                                SixPointVariant::kPairs, MachineCalibration::Exact(), {});
  ASSERT_TRUE(fit.ok());
  EXPECT_EQ(fit->outcome, Outcome::kTooLittleOverlap);
  EXPECT_NE(fit->evidence.remark.find("D3"), std::string::npos) << fit->evidence.remark;
}

TEST(SixPoint, RefusesDatumsThatAreNotOnTheSurface) {
  const FittedScan registered = FitScan(Spread(*BladeSurface(), 20000, 25), 0);
  const auto code = [&](const std::vector<DatumPoint>& datums) {
    return FitSixPoints(*BladeSurface(), registered.portions, datums, registered.best_fit, SixPointVariant::kPairs,
                        MachineCalibration::Exact(), {})
        .status()
        .code();
  };
  std::vector<DatumPoint> datums = Nest();
  datums[2].point_mm += 0.5 * datums[2].normal;
  EXPECT_EQ(code(datums), absl::StatusCode::kInvalidArgument);
  datums = Nest();
  datums[2].normal = -datums[2].normal;
  EXPECT_EQ(code(datums), absl::StatusCode::kInvalidArgument);
  datums.pop_back();
  EXPECT_EQ(code(datums), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace sixpoint::metrology
