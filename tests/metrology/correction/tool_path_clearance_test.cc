// The tool's cylinder along a path beside walls at known distances, and by looking at many places.
#include "metrology/correction/tool_path_clearance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "metrology/correction/mouth.h"
#include "metrology/correction/path_motion.h"
#include "metrology/frames/angles.h"
#include "refusal/refusal.h"
#include "tests/metrology/correction/some_path.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;
const PathTool kTool{0.4, 6};
const PathClearanceLimits kLimits{0.6, 0.3};

void AddSheet(const Eigen::Vector3d& corner, const Eigen::Vector3d& one, const Eigen::Vector3d& other,
              TriangleMesh* mesh) {
  const auto first = static_cast<std::uint32_t>(mesh->vertices_mm.size());
  for (const Eigen::Vector3d& at :
       {corner, Eigen::Vector3d(corner + one), Eigen::Vector3d(corner + one + other), Eigen::Vector3d(corner + other)})
    mesh->vertices_mm.push_back(at);
  mesh->triangles.push_back({first, first + 1, first + 2});
  mesh->triangles.push_back({first, first + 2, first + 3});
}

// The plane Z = 0, and a wall across X that stands on it.
std::shared_ptr<const Surface> FloorAndWall(double wall_x_mm) {
  TriangleMesh mesh;
  AddSheet({-20, -20, 0}, {20 + wall_x_mm, 0, 0}, {0, 40, 0}, &mesh);
  AddSheet({wall_x_mm, -20, 0}, {0, 0, 30}, {0, 40, 0}, &mesh);
  return *Surface::Prepare(std::move(mesh));
}

struct Led {
  NominalToolPath path;
  CorrectedToolPath corrected;
  RegisteredPose pose = ExactPose(Eigen::Isometry3d::Identity());
  RotaryAxes axes;
  absl::StatusOr<std::vector<PathClearance>> Measure(const Surface& surface, const PathTool& tool = kTool,
                                                     const PathClearanceLimits& limits = kLimits,
                                                     const std::function<bool()>& keep_going = nullptr) const {
    return MeasurePathClearances(path, corrected, pose, axes, {}, tool, limits, surface, keep_going);
  }
};

Led LedAlong(NominalToolPath path, const RegisteredPose& pose, const RotaryAxes& axes) {
  Led led{std::move(path), {}, pose, axes};
  auto corrected = CorrectToolPath(led.path, pose, pose.zero_from_part, axes, kWideLimits, {{1, 0, 20}, {300, 0, 0}});
  EXPECT_TRUE(corrected.ok()) << corrected.status();
  if (corrected.ok()) led.corrected = *corrected;
  return led;
}
// Somewhere on the machine: distances on the part are what they are.
Led LedAlong(NominalToolPath path) {
  std::mt19937_64 random(3);
  return LedAlong(std::move(path), ExactPose(SomePlace(random).real), SomeAxes());
}

bool StaysClear(const std::vector<PathClearance>& clearances, const PathClearanceLimits& limits = kLimits) {
  return std::all_of(clearances.begin(), clearances.end(),
                     [&](const PathClearance& one) { return one.clearance_mm >= limits.clearance_mm; });
}

NominalToolPath Upright(double length_mm, int count) {
  NominalToolPath path;
  path.name = "F1";
  for (int k = 0; k < count; ++k) path.poses.push_back({{length_mm * k / (count - 1), 0, 0}, {0, 0, 1}});
  return path;
}

// Upright to 2 mm along X, a wall at 3 mm: 3 - 2 - 0.2.
TEST(ToolPathClearance, IsTheWallsDistanceLessTheRadius) {
  const Led led = LedAlong(Upright(2, 5));
  const auto found = led.Measure(*FloorAndWall(3));
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_EQ(found->size(), 4u);
  EXPECT_TRUE(StaysClear(*found));
  // At 2.4 mm it is 0.2 at the end, and 0.45 to the wall at half a millimetre before; what passes is only known to pass.
  const auto near = led.Measure(*FloorAndWall(2.4));
  ASSERT_TRUE(near.ok());
  EXPECT_NEAR(near->back().clearance_mm, 0.2, 0.011);
  EXPECT_GE(near->back().clearance_mm, 0.2 - 1e-9);
  EXPECT_GE(near->at(2).clearance_mm, 0.3);
  EXPECT_EQ(near->back().from, 3);
}

// The fan leans to 20 degrees: the holder's end comes nearest, at 2 + 6 sin 20.
TEST(ToolPathClearance, OfALeaningToolIsAtItsHolder) {
  const Led led = LedAlong(FanOnAPlane(9));
  const double reach_mm = 2 + kTool.length_mm * std::sin(20 * kRadPerDeg) + kTool.diameter_mm / 2;
  auto found = led.Measure(*FloorAndWall(reach_mm + 0.32));
  ASSERT_TRUE(found.ok());
  EXPECT_TRUE(StaysClear(*found));
  found = led.Measure(*FloorAndWall(reach_mm + 0.25));
  ASSERT_TRUE(found.ok());
  EXPECT_NEAR(found->back().clearance_mm, 0.25, 0.011);
  EXPECT_GT(found->back().share, 0.9);
  EXPECT_GT(found->back().height_mm, 5.9);
  EXPECT_FALSE(StaysClear(*found));
}

// Over a plane, at the angle e from it, the mouth's rim is (radius + mouth) sin e from the axis.
TEST(ToolPathClearance, NeedsAMouthAsWideAsTheToolLeans) {
  for (const double angle_deg : {25.0, 40.0, 70.0}) {
    NominalToolPath path = Upright(1, 3);
    for (ToolPose& pose : path.poses)
      pose.axis_in_part = {std::cos(angle_deg * kRadPerDeg), 0, std::sin(angle_deg * kRadPerDeg)};
    const Led led = LedAlong(path);
    const double enough_mm = (0.2 + kLimits.clearance_mm) / std::sin(angle_deg * kRadPerDeg) - 0.2;
    // Pieces at the rim are up to 0.05 mm long.
    for (const double more_mm : {-0.02, 0.07}) {
      const PathClearanceLimits limits{std::max(enough_mm + more_mm, 0.301), 0.3};
      const auto found = led.Measure(*FloorAndWall(40), kTool, limits);
      ASSERT_TRUE(found.ok()) << found.status();
      if (enough_mm + more_mm > 0.301) {
        EXPECT_EQ(StaysClear(*found, limits), more_mm > 0) << angle_deg;
      }
    }
  }
}

// A post between two poses, above the mouth, that neither of them comes near.
TEST(ToolPathClearance, SeesWhatStandsBetweenTwoPoses) {
  TriangleMesh mesh;
  AddSheet({-20, -20, 0}, {60, 0, 0}, {0, 40, 0}, &mesh);
  AddSheet({5, 0.3, 3}, {0, 0, 1}, {0, 5, 0}, &mesh);
  const auto surface = Surface::Prepare(std::move(mesh));
  const Led led = LedAlong(Upright(10, 2));
  const auto found = led.Measure(**surface);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->size(), 1u);
  EXPECT_NEAR(found->front().clearance_mm, 0.1, 0.011);
  EXPECT_NEAR(found->front().share, 0.5, 0.02);
  EXPECT_GE(found->front().height_mm, 2.9);
  EXPECT_LE(found->front().height_mm, 4.1);
}

TEST(ToolPathClearance, AHolderWithinAClosedPartIsSeen) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices_mm.emplace_back(i & 1 ? 30 : -30, i & 2 ? 30 : -30, i & 4 ? 0 : -60);
  mesh.triangles = {{4, 5, 7}, {4, 7, 6}, {0, 2, 3}, {0, 3, 1}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  mesh.closed = true;
  const auto block = *Surface::Prepare(std::move(mesh));
  NominalToolPath path = Upright(1, 2);
  EXPECT_TRUE(StaysClear(*LedAlong(path).Measure(*block)));
  for (ToolPose& pose : path.poses) pose.tip_in_part_mm.z() = -30;  // all of it deep within
  const auto found = LedAlong(path).Measure(*block);
  ASSERT_TRUE(found.ok());
  EXPECT_NEAR(found->front().clearance_mm, -24.2, 1e-9);
  EXPECT_FALSE(StaysClear(*found));
}

// Leaning paths among sheets at random, against a grid of the way and the tool's length.
TEST(ToolPathClearance, AgreesWithLookingAtAGrid) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> unit(-1, 1);
  const Led led = LedAlong(FanOnAPlane(3));
  const auto looked = [&](const Surface& surface, std::size_t k) {
    const PathMotion motion(led.corrected.poses[k], led.corrected.poses[k + 1], led.axes, led.pose.positioning);
    const Eigen::Isometry3d part_from_zero = led.pose.zero_from_part.inverse();
    double least_mm = 1e9;
    for (int i = 0; i <= 60; ++i)
      for (int j = 0; j <= 60; ++j) {
        const PathMotion::Place at = motion.At(i / 60.0);
        const Eigen::Vector3d in_part =
            part_from_zero * (at.tip_in_zero_mm + kTool.length_mm * j / 60 * at.axis_in_zero);
        least_mm = std::min(least_mm, std::abs(surface.Closest(in_part).signed_distance_mm) - 0.2);
      }
    return least_mm;
  };
  int passed = 0, refused = 0;
  for (int round = 0; round < 150; ++round) {
    TriangleMesh mesh;
    const auto vector = [&](double scale) -> Eigen::Vector3d {
      return scale * Eigen::Vector3d(unit(random), unit(random), unit(random));
    };
    AddSheet(Eigen::Vector3d(2, 0, 4.5) + vector(3), vector(1.5), vector(1.5), &mesh);
    const auto surface = *Surface::Prepare(std::move(mesh));
    const auto found = led.Measure(*surface);
    ASSERT_TRUE(found.ok());
    for (std::size_t k = 0; k < 2; ++k) {
      const double least_mm = looked(*surface, k), clearance_mm = found->at(k).clearance_mm;
      // Between two of the grid's places the tool goes 0.06 mm; what is found is off by 0.01 mm.
      if (least_mm < 0.3 || least_mm > 0.37) {
        EXPECT_EQ(clearance_mm >= 0.3, least_mm > 0.3) << round;
      }
      if (clearance_mm < 0.3) {
        EXPECT_NEAR(clearance_mm, least_mm, 0.07) << round;
      }
      passed += clearance_mm >= 0.3;
      refused += clearance_mm < 0.3;
    }
  }
  EXPECT_GT(passed, 20);
  EXPECT_GT(refused, 20);
}

// Nothing of the mouth stays, nothing else goes but a piece's width at the rim.
TEST(Mouth, IsCutOutAlongTheTips) {
  TriangleMesh mesh;
  AddSheet({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, &mesh);
  const TipLine line({{0, 0, 0}, {3, 0, 0}, {3, 2, 0}});
  const double reach_mm = 0.8, piece_mm = 0.05;
  const Eigen::AlignedBox3d box_mm(Eigen::Vector3d(-9, -9, -1), Eigen::Vector3d(9, 9, 1));
  const TriangleMesh without = *WithoutMouth(mesh, line, reach_mm, piece_mm, box_mm);
  EXPECT_LT(without.triangles.size(), 20'000u);
  const auto surface = *Surface::Prepare(TriangleMesh(without));
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place(-4, 6);
  int in_mouth = 0;
  for (int i = 0; i < 4000; ++i) {
    const Eigen::Vector3d at(place(random), place(random), 0);
    const double from_line_mm = line.DistanceMm(at);
    const double from_rest_mm = std::abs(surface->Closest(at).signed_distance_mm);
    if (from_line_mm > reach_mm) {
      EXPECT_LT(from_rest_mm, 1e-9);
    } else {
      EXPECT_GE(from_rest_mm, reach_mm - from_line_mm - piece_mm - 1e-9);
      ++in_mouth;
    }
  }
  EXPECT_GT(in_mouth, 200);
}

// Twenty lines of a metre: forty metres of rim.
TEST(Mouth, EndsWithItsCallerAndAtSoManyHalvings) {
  TriangleMesh mesh;
  AddSheet({-20, -20, 0}, {1100, 0, 0}, {0, 1100, 0}, &mesh);
  Points tips_mm;
  for (int i = 0; i < 20; ++i) {
    tips_mm.emplace_back(i % 2 == 0 ? 0 : 1000, 50 * i, 0);
    tips_mm.emplace_back(i % 2 == 0 ? 1000 : 0, 50 * i, 0);
  }
  const TipLine line(tips_mm);
  const Eigen::AlignedBox3d box_mm(Eigen::Vector3d(-9, -9, -1), Eigen::Vector3d(1009, 1009, 1));
  const auto refused = WithoutMouth(mesh, line, 0.3, 0.01, box_mm).status();
  EXPECT_TRUE(absl::IsInvalidArgument(refused)) << refused;
  ASSERT_EQ(ViolationsOf(refused).size(), 1u);
  EXPECT_EQ(ViolationsOf(refused)[0].field, "mouth");
  int asked = 0;
  const auto stopped = WithoutMouth(mesh, line, 0.3, 0.01, box_mm, [&] { return ++asked < 10; }).status();
  EXPECT_TRUE(absl::IsCancelled(stopped)) << stopped;
  EXPECT_EQ(asked, 10);
}

TEST(ToolPathClearance, EndsWithItsCallerAndRefusesByName) {
  const Led led = LedAlong(Upright(2, 3));
  const auto surface = FloorAndWall(3);
  EXPECT_TRUE(absl::IsCancelled(led.Measure(*surface, kTool, kLimits, [] { return false; }).status()));
  const auto violations = ViolationsOf(led.Measure(*surface, {0, 6}, {0.3, 0.3}).status());
  ASSERT_EQ(violations.size(), 2u);
  EXPECT_EQ(violations[0].field, "tool.diameter_mm");
  EXPECT_EQ(violations[1].field, "limits.clearance_mm");
  const auto wide = ViolationsOf(led.Measure(*surface, {10.1, 6}, {10.1, 0.3}).status());
  ASSERT_EQ(wide.size(), 2u);
  EXPECT_EQ(wide[0].field, "tool.diameter_mm");
  EXPECT_EQ(wide[1].field, "limits.mouth_mm");
  EXPECT_EQ(wide[1].wanted, "at most 10");
  Led many = led;
  many.path.poses.resize(5001, led.path.poses[0]);
  many.corrected.poses.resize(5001, led.corrected.poses[0]);
  EXPECT_THAT(std::string(many.Measure(*surface).status().message()),
              HasSubstr("paths[F1].poses: 5001, want at most 5000"));
  const auto one = led.Measure(*surface), other = led.Measure(*surface);
  for (std::size_t k = 0; k < one->size(); ++k) {
    EXPECT_EQ(one->at(k).clearance_mm, other->at(k).clearance_mm);
    EXPECT_EQ(one->at(k).share, other->at(k).share);
  }
}

}  // namespace
}  // namespace sixpoint::metrology
