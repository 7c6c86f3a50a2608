// Between the poses of a path: by the closed form about a rotary axis, by looking at many places, and by the poses that it asks for.
#include "metrology/correction/tool_path_steps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metrology/correction/path_motion.h"
#include "metrology/frames/angles.h"
#include "refusal/refusal.h"
#include "tests/metrology/correction/some_path.h"

namespace sixpoint::metrology {
namespace {

// About A's axis, the tool radially: the tool stands still and the part turns, so that the tip goes round an arc.
NominalToolPath RoundA(double radius_mm, double step_deg, int count) {
  NominalToolPath path;
  path.name = "F1";
  path.position_tolerance_mm = 0.05;
  path.inclination_tolerance_rad = 0.5 * kRadPerDeg;
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector3d out(std::sin(k * step_deg * kRadPerDeg), 0, std::cos(k * step_deg * kRadPerDeg));
    path.poses.push_back({radius_mm * out, out});
  }
  return path;
}

TEST(ToolPathSteps, AboutARotaryAxisTheChordIsTheArcsHeight) {
  for (const double radius_mm : {10.0, 80.0, 200.0})
    for (const double step_deg : {0.5, 2.0, 10.0}) {
      const NominalToolPath path = RoundA(radius_mm, step_deg, 4);
      const auto corrected =
          CorrectToolPath(path, ExactPose(Eigen::Isometry3d::Identity()), Eigen::Isometry3d::Identity(), RotaryAxes(),
                          kWideLimits, {{12 * kRadPerDeg, 0, 0}, {1, 0, 0}});
      ASSERT_TRUE(corrected.ok()) << corrected.status();
      const auto steps = MeasurePathSteps(path, *corrected, RotaryAxes(), {});
      ASSERT_TRUE(steps.ok()) << steps.status();
      ASSERT_EQ(steps->size(), 3u);
      const double height_um = 1e3 * radius_mm * (1 - std::cos(step_deg * kRadPerDeg / 2));
      for (const PathStep& step : *steps) {
        EXPECT_GE(step.chord_um, height_um - 1e-9);
        EXPECT_LE(step.chord_um, 1.001 * height_um + 0.001);
        EXPECT_LT(step.axis_deg, 1e-6);
      }
    }
}

struct Solved {
  NominalToolPath path;
  CorrectedToolPath corrected;
  RegisteredPose pose = ExactPose(Eigen::Isometry3d::Identity());
};

// A fan of that many poses somewhere on the blade, on axes with tables that bend every five degrees.
Solved Somewhere(std::mt19937_64& random, int count) {
  const SomePlace place(random);
  std::uniform_real_distribution<double> unit(-1, 1);
  Solved solved{FanOnAPlane(count), {}, ExactPose(place.real)};
  Eigen::Vector3d lean(unit(random), unit(random), 0);
  for (ToolPose& pose : solved.path.poses) {
    pose.tip_in_part_mm += Eigen::Vector3d(20 * unit(random), -20, 8);
    pose.axis_in_part = (pose.axis_in_part + 0.3 * lean * pose.axis_in_part.x()).normalized();
  }
  AngleTable table;
  for (int i = 0; i < 72; ++i) table.forward_rad.push_back(1.5e-4 * std::sin(7 * i * 5 * kRadPerDeg));
  table.backward_rad = table.forward_rad;
  solved.pose.positioning.a.table = solved.pose.positioning.b.table = table;
  auto corrected =
      CorrectToolPath(solved.path, solved.pose, place.nominal, SomeAxes(), kWideLimits, {{1, 0, 20}, {300, 0, 0}});
  EXPECT_TRUE(corrected.ok()) << corrected.status();
  if (corrected.ok()) solved.corrected = *corrected;
  return solved;
}

// By its own means: the angle from the plane of both axes, or from the nearer one.
double FromTurnDeg(const Eigen::Vector3d& d, const Eigen::Vector3d& one, const Eigen::Vector3d& other) {
  const auto angle = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) / kRadPerDeg;
  };
  const Eigen::Vector3d normal = one.cross(other).normalized();
  const Eigen::Vector3d in_plane = (d - d.dot(normal) * normal).normalized();
  const bool between = angle(one, in_plane) + angle(in_plane, other) <= angle(one, other) + 1e-9;
  return between ? std::abs(90 - angle(d, normal)) : std::min(angle(d, one), angle(d, other));
}

TEST(ToolPathSteps, AgreeWithLookingAtFiveThousandPlaces) {
  std::mt19937_64 random(7);
  double greatest_axis_deg = 0;
  for (int round = 0; round < 30; ++round) {
    const Solved solved = Somewhere(random, 3);
    const auto steps = MeasurePathSteps(solved.path, solved.corrected, SomeAxes(), solved.pose.positioning);
    ASSERT_TRUE(steps.ok()) << steps.status();
    for (const PathStep& step : *steps) {
      const auto k = static_cast<std::size_t>(step.from);
      const PathMotion motion(solved.corrected.poses[k], solved.corrected.poses[k + 1], SomeAxes(),
                              solved.pose.positioning);
      const PathMotion::Place from = motion.At(0), to = motion.At(1);
      const Eigen::Vector3d along = to.tip_in_zero_mm - from.tip_in_zero_mm;
      double chord_um = 0, axis_deg = 0;
      for (int i = 0; i <= 5000; ++i) {
        const PathMotion::Place at = motion.At(i / 5000.0);
        const double share = (at.tip_in_zero_mm - from.tip_in_zero_mm).dot(along) / along.squaredNorm();
        const Eigen::Vector3d nearest = from.tip_in_zero_mm + std::min(1.0, std::max(0.0, share)) * along;
        chord_um = std::max(chord_um, 1e3 * (at.tip_in_zero_mm - nearest).norm());
        axis_deg = std::max(axis_deg, FromTurnDeg(at.axis_in_zero, from.axis_in_zero, to.axis_in_zero));
      }
      EXPECT_GE(step.chord_um, chord_um - 1e-6);
      EXPECT_LE(step.chord_um, 1.0015 * chord_um + 0.002);
      EXPECT_GE(step.axis_deg, axis_deg - 1e-7);
      EXPECT_LE(step.axis_deg, 1.0015 * axis_deg + 2e-6);
      greatest_axis_deg = std::max(greatest_axis_deg, axis_deg);
    }
  }
  EXPECT_GT(greatest_axis_deg, 0.01);  // there is something to find
}

// The poses that are asked for, on the line and the turn between two, are enough; a third of them are not.
TEST(ToolPathSteps, AsManyPosesMoreAreEnough) {
  std::mt19937_64 random(13);
  int asked = 0;
  for (int round = 0; round < 20; ++round) {
    Solved solved = Somewhere(random, 3);
    const auto shares = PathDeviationShares{0.1, 0.02};
    const auto steps = MeasurePathSteps(solved.path, solved.corrected, SomeAxes(), solved.pose.positioning, shares);
    ASSERT_TRUE(steps.ok()) << steps.status();
    for (const bool enough : {true, false}) {
      NominalToolPath finer = solved.path;
      finer.poses.clear();
      bool fewer = false;
      for (std::size_t k = 0; k < solved.path.poses.size(); ++k) {
        finer.poses.push_back(solved.path.poses[k]);
        if (k + 1 == solved.path.poses.size()) break;
        const int more = enough ? steps->at(k).more_poses : steps->at(k).more_poses / 3;
        fewer = fewer || steps->at(k).more_poses > 2;
        asked += enough ? more : 0;
        const ToolPose &one = solved.path.poses[k], &other = solved.path.poses[k + 1];
        const auto turn = Eigen::Quaterniond::FromTwoVectors(one.axis_in_part, other.axis_in_part);
        for (int i = 1; i <= more; ++i) {
          const double share = i / (more + 1.0);
          finer.poses.push_back({one.tip_in_part_mm + share * (other.tip_in_part_mm - one.tip_in_part_mm),
                                 Eigen::Quaterniond::Identity().slerp(share, turn) * one.axis_in_part});
        }
      }
      const auto corrected = CorrectToolPath(finer, solved.pose, solved.pose.zero_from_part, SomeAxes(), kWideLimits,
                                             {{1, 0, 20}, {300, 0, 0}});
      ASSERT_TRUE(corrected.ok()) << corrected.status();
      const auto again = MeasurePathSteps(finer, *corrected, SomeAxes(), solved.pose.positioning, shares);
      ASSERT_TRUE(again.ok());
      const absl::Status status = CheckPathSteps(finer, *again, shares);
      if (enough || fewer) {
        EXPECT_EQ(status.ok(), enough) << round << " " << status;
      }
    }
  }
  EXPECT_GT(asked, 40);
}

TEST(ToolPathSteps, RefuseWhereAndByHowManyPoses) {
  const NominalToolPath path = RoundA(80, 10, 3);  // 304 um high
  const auto corrected = CorrectToolPath(path, ExactPose(Eigen::Isometry3d::Identity()), Eigen::Isometry3d::Identity(),
                                         RotaryAxes(), kWideLimits, {{12 * kRadPerDeg, 0, 0}, {1, 0, 0}});
  const auto steps = MeasurePathSteps(path, *corrected, RotaryAxes(), {});
  ASSERT_TRUE(steps.ok());
  const auto violations = ViolationsOf(CheckPathSteps(path, *steps));
  ASSERT_EQ(violations.size(), 2u);
  EXPECT_EQ(violations[1].field, "paths[F1].poses[1]");
  EXPECT_THAT(violations[1].value, ::testing::StartsWith("to the next one 304."));
  // 304.4 / 12.5 is 24.4: five steps, with the margin six.
  EXPECT_EQ(violations[1].wanted, "at most 12.5 um and 0.125 deg: 5 more between the two");
  NominalToolPath without = path;
  without.inclination_tolerance_rad = 0;
  EXPECT_EQ(ViolationsOf(MeasurePathSteps(without, *corrected, RotaryAxes(), {}).status()).at(0).field,
            "paths[F1].inclination_tolerance_rad");
  NominalToolPath many = path;
  many.poses.resize(5001, path.poses[0]);
  CorrectedToolPath as_many = *corrected;
  as_many.poses.resize(5001, corrected->poses[0]);
  EXPECT_EQ(ViolationsOf(MeasurePathSteps(many, as_many, RotaryAxes(), {}).status()).at(0).wanted, "at most 5000");
  EXPECT_TRUE(
      absl::IsCancelled(MeasurePathSteps(path, *corrected, RotaryAxes(), {}, {}, [] { return false; }).status()));
}

}  // namespace
}  // namespace sixpoint::metrology
