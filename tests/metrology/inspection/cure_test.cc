// Blanks whose surface one motion cures, and those that none does: closed forms, and random worlds held against what was put in.
#include "metrology/inspection/cure.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "metrology/inspection/verdict.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// Both sides of a plate of 40 x 20 mm, 4 mm thick, patches of 2 mm; without deviation, between -0.1 and 0.1.
std::vector<LimitedPatch> Plate() {
  std::vector<LimitedPatch> patches;
  for (double x = -19; x < 20; x += 2)
    for (double y = -9; y < 10; y += 2)
      for (const double side : {1.0, -1.0})
        patches.push_back({Vector3d(x, y, 2 * side), Vector3d(0, 0, side), 0, 0.005, 0.005, -0.1, 0.1});
  return patches;
}

// What a motion of the part about the origin does to its deviations, to first order: turned by w, shifted by t.
void Move(const Vector3d& w, const Vector3d& t, std::vector<LimitedPatch>* patches) {
  for (LimitedPatch& patch : *patches) patch.deviation_mm += (w.cross(patch.centre_mm) + t).dot(patch.normal);
}

// The patches as the cure leaves them.
std::vector<double> Cured(const std::vector<LimitedPatch>& patches, const Vector6d& motion) {
  Vector3d middle = Vector3d::Zero();
  for (const LimitedPatch& patch : patches) middle += patch.centre_mm / static_cast<double>(patches.size());
  std::vector<double> left;
  for (const LimitedPatch& patch : patches)
    left.push_back(patch.deviation_mm -
                   (motion.head<3>().cross(patch.centre_mm - middle) + motion.tail<3>()).dot(patch.normal));
  return left;
}

// No pushes without balance: whatever moves, some of it gets worse.
void ExpectProof(const std::vector<LimitedPatch>& patches, const CureFinding& finding) {
  ASSERT_FALSE(finding.conflicts.empty());
  EXPECT_LE(finding.conflicts.size(), 7u);
  double share = 0, lacking_mm = 0;
  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
  for (const CureFinding::Conflict& conflict : finding.conflicts) {
    const LimitedPatch& patch = patches[conflict.patch];
    const double sign = conflict.above ? 1 : -1;
    share += conflict.share;
    force += sign * conflict.share * patch.normal;
    moment += sign * conflict.share * patch.centre_mm.cross(patch.normal);
    lacking_mm += conflict.share * (conflict.above ? patch.deviation_mm - patch.outside_guard_mm - patch.upper_mm
                                                   : patch.lower_mm - patch.outside_guard_mm - patch.deviation_mm);
  }
  EXPECT_NEAR(share, 1, 1e-9);
  EXPECT_LT(force.norm(), 1e-6);
  EXPECT_LT(moment.norm(), 1e-5);
  EXPECT_GT(lacking_mm, 0);
}

TEST(FindCure, OfAPartThatIsOnlyMovedIsTheWayBack) {
  auto patches = Plate();
  Move({0.004, -0.003, 0}, {0, 0, 0.3}, &patches);
  const auto finding = FindCure(patches);
  ASSERT_TRUE(finding.ok()) << finding.status();
  ASSERT_EQ(finding->cure, Cure::kPossible);
  for (const double left_mm : Cured(patches, finding->motion)) EXPECT_LE(std::abs(left_mm), 0.095 + 1e-9);
  EXPECT_TRUE(finding->conflicts.empty());
}

// 0.25 mm too thick: within +-0.1 neither side can be without the other's being out.
TEST(FindCure, OfAPlateThatIsTooThickIsNoneAndBothSidesSayWhy) {
  auto patches = Plate();
  for (LimitedPatch& patch : patches) patch.deviation_mm = 0.125;
  const auto finding = FindCure(patches);
  ASSERT_TRUE(finding.ok()) << finding.status();
  ASSERT_EQ(finding->cure, Cure::kNone);
  ExpectProof(patches, *finding);
}

// Just so much too thick that the uncertainty leaves it open: 2 * (0.1 - 0.005) < 0.2 < 2 * (0.1 + 0.005).
TEST(FindCure, WithinTheUncertaintyOfTheLimitsIsUnknown) {
  auto patches = Plate();
  for (LimitedPatch& patch : patches) patch.deviation_mm = 0.1;
  EXPECT_EQ(FindCure(patches)->cure, Cure::kUnknown);
  for (LimitedPatch& patch : patches) patch.deviation_mm = 0.0949;
  EXPECT_EQ(FindCure(patches)->cure, Cure::kPossible);
  for (LimitedPatch& patch : patches) patch.deviation_mm = 0.1051;
  EXPECT_EQ(FindCure(patches)->cure, Cure::kNone);
}

// A least-squares fit leaves one corner out; the motion that minds the limits alone does not.
TEST(FindCure, IsFoundWhereTheLeastSquaresFitHasNone) {
  std::vector<LimitedPatch> patches;
  for (double x = -19; x < 20; x += 2)
    patches.push_back({Vector3d(x, 0, 0), Vector3d::UnitZ(), x > 17 ? 0.19 : 0.0, 0, 0, -0.1, 0.1});
  const auto finding = FindCure(patches);
  ASSERT_EQ(finding->cure, Cure::kPossible);
  for (const double left_mm : Cured(patches, finding->motion)) EXPECT_LE(std::abs(left_mm), 0.1 + 1e-9);
}

// A zone so narrow that a value in its middle conforms by less than 95 %: beside one limit it would seem to.
TEST(FindCure, MindsBothLimitsOfANarrowZone) {
  const DecisionRule rule = DecisionRule::Probability();
  const double expanded_mm = 0.012, half_mm = 0.010;
  EXPECT_LT(rule.guard_factor * expanded_mm, half_mm);
  EXPECT_EQ(Judge(0, expanded_mm, {-half_mm, half_mm}, rule), Verdict::kUndecidable);
  auto patches = Plate();
  for (LimitedPatch& patch : patches) {
    patch.inside_guard_mm = rule.sure_guard_factor() * expanded_mm;
    patch.outside_guard_mm = rule.guard_factor * expanded_mm;
    patch.lower_mm = -half_mm;
    patch.upper_mm = half_mm;
  }
  EXPECT_EQ(FindCure(patches)->cure, Cure::kUnknown);
}

// So far is no longer a correction: deviations would not follow in proportion.
TEST(FindCure, BeyondSmallMotionsIsUnknown) {
  auto patches = Plate();
  Move({0.05, 0, 0}, Vector3d::Zero(), &patches);
  EXPECT_EQ(FindCure(patches)->cure, Cure::kUnknown);
  patches = Plate();
  Move(Vector3d::Zero(), {0, 0, 1.5}, &patches);
  EXPECT_EQ(FindCure(patches)->cure, Cure::kUnknown);
}

// Random shapes: where a cure is said it holds, and where none is said no motion of many thousands brings every patch inside.
TEST(FindCure, HoldsInRandomWorlds) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  int possible = 0, none = 0;
  for (int world = 0; world < 200; ++world) {
    std::vector<LimitedPatch> patches;
    const double form_mm = 0.01 + 0.06 * world / 200;
    for (int i = 0; i < 120; ++i) {
      const Vector3d direction = Vector3d(normal(random), normal(random), normal(random)).normalized();
      patches.push_back({Vector3d(20 * direction.x(), 10 * direction.y(), 5 * direction.z()), direction,
                         form_mm * normal(random), 0.002, 0.002, -0.1, 0.1});
    }
    Move(1e-3 * Vector3d(normal(random), normal(random), normal(random)),
         0.1 * Vector3d(normal(random), normal(random), normal(random)), &patches);
    const auto finding = FindCure(patches);
    ASSERT_TRUE(finding.ok()) << finding.status();
    if (finding->cure == Cure::kPossible) {
      ++possible;
      for (const double left_mm : Cured(patches, finding->motion)) ASSERT_LE(std::abs(left_mm), 0.098 + 1e-9);
    } else if (finding->cure == Cure::kNone) {
      ++none;
      ExpectProof(patches, *finding);
      for (int k = 0; k < 2000; ++k) {
        Vector6d motion;
        for (int i = 0; i < 6; ++i) motion[i] = (i < 3 ? 2e-3 : 0.2) * normal(random);
        double worst_mm = 0;
        for (const double left_mm : Cured(patches, motion)) worst_mm = std::max(worst_mm, std::abs(left_mm));
        ASSERT_GT(worst_mm, 0.1);
      }
    }
  }
  EXPECT_GT(possible, 30);
  EXPECT_GT(none, 30);
}

TEST(FindCure, IsTheSameTwice) {
  auto patches = Plate();
  Move({0.004, -0.003, 0}, {0, 0, 0.3}, &patches);
  EXPECT_EQ(FindCure(patches)->motion, FindCure(patches)->motion);
}

TEST(FindCure, RefusesWhatIsNoSurface) {
  EXPECT_EQ(FindCure({}).status().code(), absl::StatusCode::kInvalidArgument);
  auto patches = Plate();
  patches[3].deviation_mm = std::nan("");
  EXPECT_EQ(FindCure(patches).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(FindCure(Plate(), [] { return false; }).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace sixpoint::metrology
