#include "metrology/registration/merged_views.h"

#include <gtest/gtest.h>

#include "tests/metrology/registration/sampled_blade.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kCentreMm = 1e-3;

// What is believed of the machine: the second axis' place to a micrometre.
MachineCalibration MachineOnCentre() {
  MachineCalibration machine = MachineCalibration::Exact();
  machine.axes.a = {Vector3d::UnitY(), {10, 40, -230}};
  machine.axes.b = {Vector3d::UnitX(), {12, 42, -228}};
  machine.axes_covariance(6, 6) = machine.axes_covariance(7, 7) = kCentreMm * kCentreMm;
  return machine;
}

// Four views about the second axis, which stands off from what is believed; each sees what looks up.
std::vector<ScanPortion> ViewsAbout(const MachineCalibration& believed, const Eigen::Vector2d& off_mm,
                                    std::uint64_t seed) {
  Eigen::Matrix<double, 8, 1> error = Eigen::Matrix<double, 8, 1>::Zero();
  error.tail<2>() = off_mm;
  const RotaryAxes truth = believed.axes.Perturbed(error);
  std::vector<ScanPortion> portions;
  for (int view = 0; view < 4; ++view) {
    LineScan scan;
    scan.id = "view " + std::to_string(view);
    scan.b_rad = M_PI / 2 * view;
    const Eigen::Isometry3d machine_from_part = truth.MachineFromZero(0, scan.b_rad) * BladePose();
    const SpreadSamples seen =
        Spread(*BladeSurface(), 5000, 10 * seed + static_cast<std::uint64_t>(view),
               [&](const SurfacePoint& on) { return (machine_from_part.linear() * on.normal).z() > 0.2; });
    scan.points_mm = Scanned(seen.points_mm, machine_from_part, kNoiseMm, 10 * seed + static_cast<std::uint64_t>(view));
    portions.push_back(Thin(scan, believed, Thinning()));
  }
  return portions;
}

MergeTest Tested(const Eigen::Vector2d& off_mm, std::uint64_t seed) {
  const MachineCalibration believed = MachineOnCentre();
  const auto portions = ViewsAbout(believed, off_mm, seed);
  const auto fit = FitToSurface(*BladeSurface(), portions, StartPose(), believed, {});
  EXPECT_TRUE(fit.ok() && fit->outcome == Outcome::kConverged);
  if (!fit.ok()) return {};
  const auto test = TestMerge(*BladeSurface(), portions, *fit, believed, {});
  EXPECT_TRUE(test.ok()) << test.status();
  return test.ok() ? *test : MergeTest();
}

// Errors as the calibration says they are. Chi-squared over its freedom is 1 on average; of 24 draws of some ten degrees of
// freedom its mean scatters by 0.09, and four of those. One in a thousand is flagged: none of these.
TEST(MergedViews, RightCalibrationsAgree) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, kCentreMm);
  double sum = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    const double y = normal(random), z = normal(random);
    const MergeTest test = Tested({y, z}, seed);
    EXPECT_FALSE(test.beyond) << test.chi_squared << " of " << test.freedom;
    EXPECT_GE(test.freedom, 4);
    sum += test.chi_squared / std::max(1, test.freedom) / 24;
  }
  EXPECT_NEAR(sum, 1, 0.4);
}

// Ten of its standard uncertainties off.
TEST(MergedViews, SeesAWrongRotationCentre) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const MergeTest test = Tested(10 * kCentreMm * Eigen::Vector2d(std::cos(seed), std::sin(seed)), seed);
    EXPECT_TRUE(test.beyond) << test.chi_squared << ", limit " << test.limit;
  }
}

TEST(MergedViews, OneScanSaysNothingOfItself) {
  const MachineCalibration believed = MachineOnCentre();
  auto portions = ViewsAbout(believed, {0, 0}, 3);
  portions.resize(1);
  FitOptions options;
  options.condition_limit = 1e5;
  auto fit = FitToSurface(*BladeSurface(), portions, StartPose(), believed, options);
  ASSERT_TRUE(fit.ok());
  ASSERT_EQ(fit->outcome, Outcome::kConverged) << fit->evidence.remark;
  const auto test = TestMerge(*BladeSurface(), portions, *fit, believed, options);
  ASSERT_TRUE(test.ok());
  EXPECT_EQ(test->freedom, 0);
  EXPECT_FALSE(test->beyond);
  fit->Withdraw(Outcome::kNotConverged, "");
  EXPECT_EQ(TestMerge(*BladeSurface(), portions, *fit, believed, options).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace sixpoint::metrology
