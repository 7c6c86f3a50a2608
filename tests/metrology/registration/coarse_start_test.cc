#include "metrology/registration/coarse_start.h"

#include <gtest/gtest.h>

#include "tests/metrology/registration/sampled_blade.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// What a scanner above the part sees of it at some turn, as one portion each: only faces that look up.
std::vector<ScanPortion> ViewsOfBlade(const Isometry3d& zero_from_part, std::uint64_t seed, int view_count) {
  std::vector<ScanPortion> portions;
  for (int view = 0; view < view_count; ++view) {
    const Eigen::Matrix3d machine_from_zero = RotationFromVector(Vector3d(M_PI * view, 0, 0));
    const SpreadSamples seen = Spread(
        *BladeSurface(), 6000, seed + static_cast<std::uint64_t>(view),
        [&](const SurfacePoint& on) { return (machine_from_zero * zero_from_part.linear() * on.normal).z() > 0.35; });
    ScanPortion portion;
    portion.id = std::to_string(view);
    portion.zero_from_sensor.linear() = machine_from_zero.transpose();
    for (const Vector3d& p : Scanned(seen.points_mm, zero_from_part, 2e-3, seed))
      portion.sensor.Add(machine_from_zero * p);
    portions.push_back(portion);
  }
  return portions;
}

// Any turn, tens of millimetres away: the nominal says nothing. 6 turns; none may fail.
TEST(CoarseStart, FindsThePartFromAnyPose) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 1);
  FitOptions options;
  options.coarse_start = true;
  for (int draw = 0; draw < 6; ++draw) {
    Isometry3d pose = Isometry3d::Identity();
    pose.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                        .normalized()
                        .toRotationMatrix();
    pose.translation() = Vector3d(40, -30, 25) - pose.linear() * kPartCentreMm;
    const auto portions = ViewsOfBlade(pose, 10 + static_cast<std::uint64_t>(draw), 2);
    const auto fit = FitToSurface(*BladeSurface(), portions, BladePose(), MachineCalibration::Exact(), options);
    ASSERT_TRUE(fit.ok()) << fit.status();
    EXPECT_EQ(fit->outcome, Outcome::kConverged) << draw << ": " << fit->evidence.remark;
    // The bound is 0.2 um at the worst vertex; ten times that.
    EXPECT_LT(GreatestDisplacement(*BladeSurface(), Placed(*fit).zero_from_part, pose), 2e-3) << draw;
  }
}

TEST(CoarseStart, IsNotUsedUnlessAsked) {
  Isometry3d pose = BladePose();
  pose.linear() = RotationFromVector({2, 1, 0}) * pose.linear();
  pose.translation() = Vector3d(20, 50, -190) - pose.linear() * kPartCentreMm;
  const auto fit =
      FitToSurface(*BladeSurface(), ViewsOfBlade(pose, 1, 2), BladePose(), MachineCalibration::Exact(), {});
  ASSERT_TRUE(fit.ok());
  EXPECT_NE(fit->outcome, Outcome::kConverged);
}

TEST(CoarseStart, SameBitsOnAnyNumberOfThreads) {
  const auto portions = ViewsOfBlade(StartPose(), 5, 2);
  FitOptions options;
  options.thread_count = 1;
  const auto one = FindCoarseStart(*BladeSurface(), portions, BladePose(), options);
  options.thread_count = 2;
  const auto two = FindCoarseStart(*BladeSurface(), portions, BladePose(), options);
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_EQ(one->zero_from_part.matrix(), two->zero_from_part.matrix());
}

// A torus looks alike from every turn about its axis.
TEST(CoarseStart, SaysWhenTwoPosesFitAsWell) {
  const auto torus = *Surface::Prepare(shapes::Torus(12, 4, 96, 48, Vector3d::Zero()));
  ScanPortion portion;
  for (const Vector3d& p : Scanned(Spread(*torus, 6000, 3).points_mm, Isometry3d::Identity(), 2e-3, 3))
    portion.sensor.Add(p);
  const auto start = FindCoarseStart(*torus, {portion}, Isometry3d::Identity(), {});
  ASSERT_TRUE(start.ok());
  EXPECT_NE(start->remark.find("two poses fit as well"), std::string::npos);
}

TEST(CoarseStart, StopsWhenToldTo) {
  FitOptions options;
  options.keep_going = [] { return false; };
  EXPECT_EQ(FindCoarseStart(*BladeSurface(), ViewsOfBlade(BladePose(), 5, 1), BladePose(), options).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace sixpoint::metrology
