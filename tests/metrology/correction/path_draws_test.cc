// Draws of a pose of a tool path: as a hole where the pose alone decides its angles, and beside the first order where B is led.
#include "metrology/correction/path_draws.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "metrology/frames/angles.h"
#include "tests/metrology/correction/some_path.h"

namespace sixpoint::metrology {
namespace {

DrawOptions Options(int count, int threads = 2) {
  DrawOptions options;
  options.count = count;
  options.threads = threads;
  return options;
}

RegisteredPose Noisy(const Eigen::Isometry3d& zero_from_part, double variance) {
  RegisteredPose pose = ExactPose(zero_from_part);
  pose.noise.values = variance * Matrix6d::Identity();
  return pose;
}

TEST(PathDraws, OfAPoseThatStandsForItselfAreAHoles) {
  std::mt19937_64 random(41);
  const SomePlace place(random);
  const RegisteredPose pose = Noisy(place.real, 1e-8);
  const NominalToolPath path = FanOnAPlane(5);
  const RotaryAxes axes = SomeAxes();
  const auto corrected = CorrectToolPath(path, pose, place.nominal, axes, kWideLimits, kSomeSteps);
  ASSERT_TRUE(corrected.ok()) << corrected.status();
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_EQ(PosesPerDraw(*corrected, k), 1u);
    const auto drawn = DrawPose({path, *corrected, pose, axes, kSomeSteps}, k, Options(20'000));
    ASSERT_TRUE(drawn.ok()) << drawn.status();
    EXPECT_NEAR(drawn->expanded_uncertainty_um / corrected->poses[k].start.expanded_uncertainty_um, 1, 0.03) << k;
  }
}

// The axis passes B's by a milliradian, not midway between two poses and 30 mm beside it: B is led, and its uncertainty is that of the
// poses that lead it.
class LedPath : public ::testing::Test {
 protected:
  LedPath() : pose_(Noisy(Eigen::Isometry3d::Identity(), 1e-10)) {
    path_.name = "F2";
    path_.inclination_tolerance_rad = 1 * kRadPerDeg;
    for (const double lean : {-0.15, -0.1, -0.03, 0.0, 0.08, 0.13})
      path_.poses.push_back({{4 * lean + 30, 0, 0}, Eigen::Vector3d(lean, 1e-3, 1).normalized()});
    axes_.a = {Eigen::Vector3d::UnitY(), {0, 0, -50}};
    axes_.b = {Eigen::Vector3d::UnitZ(), {0, 0, -50}};
    corrected_ = CorrectToolPath(path_, pose_, Eigen::Isometry3d::Identity(), axes_, kWideLimits, kSomeSteps).value();
  }
  DrawnPath Drawn() const { return {path_, corrected_, pose_, axes_, kSomeSteps}; }

  NominalToolPath path_;
  RegisteredPose pose_;
  RotaryAxes axes_;
  CorrectedToolPath corrected_;
};

TEST_F(LedPath, IsSolvedAnewAsAWhole) {
  ASSERT_TRUE(corrected_.poses[3].b_is_free);
  EXPECT_EQ(PosesPerDraw(corrected_, 3), 6u);
  const auto led = DrawPose(Drawn(), 3, Options(4000));
  ASSERT_TRUE(led.ok()) << led.status();
  const double stated_um = corrected_.poses[3].start.expanded_uncertainty_um;
  EXPECT_NEAR(led->expanded_uncertainty_um / stated_um, 1, 0.06);  // 4000 draws: 95 % within 5 % of it
  // Alone it would follow its own azimuth, or stand: neither is what the machine does.
  const auto alone =
      DrawStarts(NominalPoseOf(path_, 3), CorrectedPoseOf("F2", corrected_.poses[3]), pose_, axes_, {}, Options(4000));
  ASSERT_TRUE(alone.ok()) << alone.status();
  EXPECT_LT(alone->front().expanded_uncertainty_um, 0.2 * stated_um);
}

TEST_F(LedPath, IsTheSameOnAnyNumberOfThreadsAndEndsWithItsCaller) {
  const auto one = DrawPose(Drawn(), 3, Options(1000, 1)), four = DrawPose(Drawn(), 3, Options(1000, 4));
  ASSERT_TRUE(one.ok() && four.ok());
  EXPECT_EQ(one->expanded_uncertainty_um, four->expanded_uncertainty_um);
  DrawOptions stopped = Options(1000);
  stopped.keep_going = [] { return false; };
  EXPECT_TRUE(absl::IsCancelled(DrawPose(Drawn(), 3, stopped).status()));
}

}  // namespace
}  // namespace sixpoint::metrology
