#include <gtest/gtest.h>

#include <random>

#include "metrology/studies/arm_study.h"

namespace sixpoint::metrology {
namespace {

std::vector<ArmDisplacement> Drawn(const Vector6d& arm, const Vector6d& noise, int count, std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  std::vector<ArmDisplacement> displacements(static_cast<std::size_t>(count));
  Vector6d first = Vector6d::Zero();
  for (int i = 0; i < count; ++i) {
    Vector6d pose;
    for (int k = 0; k < 6; ++k) pose[k] = arm[k] * normal(*random) + noise[k] * normal(*random);
    if (i == 0) first = pose;
    pose -= first;
    displacements[static_cast<std::size_t>(i)].angles = CardanFromRotation(RotationFromVector(pose.head<3>()));
    displacements[static_cast<std::size_t>(i)].translation_mm = pose.tail<3>();
  }
  return displacements;
}

// The arm's own spread comes back, whatever the scans' noise; where noise hides it, as much is said as could be hidden.
TEST(ArmSpread, IsTheArmsAndNotTheNoises) {
  const Vector6d arm = (Vector6d() << 2e-5, 2e-5, 3e-5, 2e-3, 4e-3, 1e-3).finished();
  const Vector6d noise = (Vector6d() << 1e-6, 6e-5, 1e-6, 1e-4, 1e-4, 5e-4).finished();
  std::mt19937_64 random(8);
  Vector6d mean = Vector6d::Zero();
  constexpr int kDraws = 400;
  for (int draw = 0; draw < kDraws; ++draw) {
    const auto spread = ArmSpreadOf(Drawn(arm, noise, 15, &random), std::sqrt(2.0) * noise);
    ASSERT_TRUE(spread.ok()) << spread.status();
    EXPECT_EQ(spread->degrees_of_freedom, 14);
    mean += spread->covariance.diagonal() / kDraws;
  }
  for (int k = 0; k < 6; ++k) {
    const double ratio = mean[k] / (arm[k] * arm[k]);
    if (k == 1)  // noise three times the arm's: never less than what is hidden there, by chance more
      EXPECT_GT(ratio, 1);
    else
      EXPECT_NEAR(ratio, 1, 0.12) << k;
  }
}

TEST(ArmSpread, RefusesTooFewAndWhatIsNotFinite) {
  std::mt19937_64 random(9);
  const Vector6d some = Vector6d::Constant(1e-4);
  EXPECT_TRUE(absl::IsInvalidArgument(ArmSpreadOf(Drawn(some, some, 4, &random), some).status()));
  std::vector<ArmDisplacement> odd = Drawn(some, some, 6, &random);
  odd[3].translation_mm.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(absl::IsInvalidArgument(ArmSpreadOf(odd, some).status()));
}

}  // namespace
}  // namespace sixpoint::metrology
