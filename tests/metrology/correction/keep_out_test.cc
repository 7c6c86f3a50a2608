#include "metrology/correction/keep_out.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

TriangleMesh BoxMesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices_mm.emplace_back((i & 1 ? high : low).x(), (i & 2 ? high : low).y(), (i & 4 ? high : low).z());
  mesh.triangles = {{4, 5, 7}, {4, 7, 6}, {0, 2, 3}, {0, 3, 1}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  mesh.closed = true;
  return mesh;
}

// A block of 20 x 10 x 4 mm, its upper face at Z 0, that turns about lines some way below it.
struct Block {
  std::shared_ptr<const Surface> surface = *Surface::Prepare(BoxMesh({-10, -5, -4}, {10, 5, 0}));
  RotaryAxes axes;
  PlacedPart part{*surface, Eigen::Isometry3d::Identity(), axes};
  std::map<std::string, NcTarget> targets = {{"G1/H1", {1, 2, 0, 0, 0}}, {"G1/H2", {5, 2, 0, 0, 0}}};
  Block() { axes.a.point_mm = axes.b.point_mm = {0, 0, -30}; }

  GateCheck Check(const std::string& program, double keep_out_mm = 0.5) const {
    const auto moves = ReadNcProgram(program, {'A', 'B'}, {});
    EXPECT_TRUE(moves.ok()) << moves.status();
    const auto check = CheckKeepOut(*moves, targets, part, keep_out_mm, nullptr);
    EXPECT_TRUE(check.ok()) << check.status();
    return *check;
  }
};

TEST(KeepOut, LetsAProgramPassThatGoesUpBetweenHoles) {
  const GateCheck check = Block().Check(
      "G0 Z10 A0 B0\nX1 Y2\nG1 Z0 F20\nG91 Z-3\nG90 Z1\nG0 X5 Y2\nG1 Z0\nG0 Z10\nA30 B-40\nA0 B0\nX40 Y-40 Z20\n");
  EXPECT_TRUE(check.passed()) << TextOf(check);
  EXPECT_NEAR(*check.value, 1, 1e-9);  // from hole to hole, a millimetre above
  EXPECT_EQ(check.subject, "line 6");
}

TEST(KeepOut, NamesTheMoveThatIsTooNear) {
  EXPECT_EQ(TextOf(Block().Check("G0 Z10 A0 B0\nX1 Y2\nG1 Z0 F20\nG0 Z0.4\nX5 Y2\n")),
            "KEEP_OUT of line 5: 0.4 mm, want at least 0.5 mm");
  // Straight from hole to hole, and down beside one.
  EXPECT_FALSE(Block().Check("G0 Z10 A0 B0\nX1 Y2\nG1 Z0 F20\nX5 Y2\n").passed());
  EXPECT_FALSE(Block().Check("G0 Z10 A0 B0\nX1 Y2.1\nZ0\n").passed());
  // Through the block, far from either end.
  EXPECT_FALSE(Block().Check("G1 X0 Y0 Z10 A0 B0\nZ-20\n").passed());
  // Turned into it.
  EXPECT_TRUE(Block().Check("G1 X0 Y0 Z3 A0 B0\nX1\n").passed());
  EXPECT_FALSE(Block().Check("G1 X0 Y0 Z1 A0 B0\nA45\n").passed());
}

// A hole's own axis is no way in for a rapid, and the inside of the block no place to stand.
TEST(KeepOut, NoRapidGoesDownAHolesAxisIntoThePart) {
  EXPECT_FALSE(Block().Check("G0 Z10 A0 B0\nX1 Y2\nZ-2\n").passed());
  EXPECT_TRUE(Block().Check("G0 Z10 A0 B0\nX1 Y2\nZ0\nG1 Z-2 F5\nG0 Z10\nX40\n").passed());
  EXPECT_FALSE(Block().Check("G1 X0 Y0 Z-2 A0 B0\n").passed());
}

// Sent home upwards it comes back from above; sent home sideways nobody knows over what.
TEST(KeepOut, KnowsWhatItComesBackFrom) {
  EXPECT_TRUE(Block().Check("G0 X40 Y0 Z10 A0 B0\nG91 G28 Z0\nG90 Z10\n").passed());
  EXPECT_FALSE(Block().Check("G0 X0 Y0 Z10 A0 B0\nG91 G28 Z0\nG90 Z-2\n").passed());
  EXPECT_FALSE(Block().Check("G0 X40 Y0 Z10 A0 B0\nG91 G28 A0\nG90 A0\n").passed());
}

// Each axis may arrive in its own time: the corner between the ends counts.
TEST(KeepOut, ARapidMayGoRoundTheCorner) {
  const char* program = "G0 X0 Y0 Z1 A0 B0\n%s X14 Z-3\n";
  char feed[128], rapid[128];
  std::snprintf(feed, sizeof feed, "G0 X-14 Y0 Z-3 A0 B0\nG1 X-24 Y0 Z7\nX-14 Y0 Z-3\n");
  std::snprintf(rapid, sizeof rapid, program, "G0");
  EXPECT_TRUE(Block().Check(feed).passed());
  EXPECT_FALSE(Block().Check(rapid).passed());
}

// What a path's electrode does from pose to pose is asked elsewhere; of any other way between its poses it is asked here.
TEST(KeepOut, OnlyTheWayFromPoseToPoseOfAPathIsItsOwn) {
  Block block;
  block.targets = {
      {"F1/1", {1, 2, 0, 0, 0, "F1", 1}}, {"F1/2", {2, 2, 0, 0, 0, "F1", 2}}, {"F1/3", {3, 2, 0, 0, 0, "F1", 3}}};
  const std::string before = "G0 Z10 A0 B0\nX1 Y2\nG1 Z0 F20 (SIXPOINT F1/1)\n", after = "G0 Z10\n";
  const std::string second = "G1 X2 A0 B0 (SIXPOINT F1/2)\n", third = "G1 X3 A0 B0 (SIXPOINT F1/3)\n";
  EXPECT_TRUE(block.Check(before + second + third + after).passed());
  EXPECT_FALSE(block.Check(before + third + after).passed()) << "past a pose";
  EXPECT_FALSE(block.Check(before + second + third + second + after).passed()) << "back";
  EXPECT_FALSE(block.Check(before + "G1 X2 A0 B0\n" + after).passed()) << "without its mark";
  EXPECT_FALSE(block.Check(before + "G0 X2 A0 B0 (SIXPOINT F1/2)\n" + after).passed()) << "by rapid";
  EXPECT_FALSE(block.Check(before + "G1 X2.01 A0 B0 (SIXPOINT F1/2)\n" + after).passed()) << "beside it";
}

TEST(KeepOut, WhatCannotBeFollowedDoesNotPass) {
  EXPECT_FALSE(Block().Check("G0 Z10\nX1\n").passed());
  EXPECT_FALSE(Block().Check("M30\n").passed());
}

// Random straight moves against a thousand places of each, by the surface itself.
TEST(KeepOut, AgreesWithLookingAtAThousandPlaces) {
  const Block block;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(-18, 18), height(-12, 12), turn(-40, 40);
  int passed = 0;
  for (int i = 0; i < 400; ++i) {
    NcMove move;
    move.line = 1;
    move.feed = true;
    for (NcPosition* end : {&move.from, &move.to})
      *end = {place(random), place(random), height(random), turn(random), turn(random)};
    if (i % 2 == 0) move.to[3] = move.from[3], move.to[4] = move.from[4];
    double least_mm = 1e9;
    for (int k = 0; k <= 1000; ++k) {
      std::array<double, 5> at{};
      for (std::size_t axis = 0; axis < 5; ++axis)
        at[axis] = *move.from[axis] + k / 1000.0 * (*move.to[axis] - *move.from[axis]);
      const Eigen::Vector3d in_part = block.axes.MachineFromZero(at[3] * kRadPerDeg, at[4] * kRadPerDeg).inverse() *
                                      Eigen::Vector3d(at[0], at[1], at[2]);
      least_mm = std::min(least_mm, std::abs(block.surface->Closest(in_part).signed_distance_mm));
    }
    const auto check = CheckKeepOut({move}, block.targets, block.part, 0.5, nullptr);
    ASSERT_TRUE(check.ok());
    // Between two of the places the tip goes at most 0.06 mm.
    if (least_mm < 0.5 || least_mm > 0.6) {
      EXPECT_EQ(check->passed(), least_mm > 0.6) << i << " " << least_mm;
    }
    passed += check->passed();
  }
  EXPECT_GT(passed, 60);
  EXPECT_LT(passed, 340);
}

TEST(KeepOut, EndsWithItsCaller) {
  const Block block;
  const auto moves = ReadNcProgram("G0 X0 Y0 Z10 A0 B0\nX1\n", {'A', 'B'}, {});
  EXPECT_TRUE(absl::IsCancelled(CheckKeepOut(*moves, block.targets, block.part, 0.5, [] { return false; }).status()));
}

TEST(LineOfSight, IsBlockedByWhatStandsOverTheHole) {
  const Block block;
  NominalHoleGroup group;
  group.name = "G1";
  group.holes = {{"H1", {0, 0, 0}}};
  GateCheck check = *CheckLinesOfSight({group}, *block.surface, 0.5, nullptr);
  EXPECT_TRUE(check.passed()) << TextOf(check);
  group.axis_in_part = Eigen::Vector3d(1, 0, 0.7).normalized();  // inclined, and free
  EXPECT_TRUE(CheckLinesOfSight({group}, *block.surface, 0.5, nullptr)->passed());
  group.axis_in_part = Eigen::Vector3d(1, 0, 0.05).normalized();  // along the face
  EXPECT_FALSE(CheckLinesOfSight({group}, *block.surface, 0.5, nullptr)->passed());
  group.axis_in_part = -Eigen::Vector3d::UnitZ();  // from below, through the block
  check = *CheckLinesOfSight({group}, *block.surface, 0.5, nullptr);
  EXPECT_FALSE(check.passed());
  EXPECT_EQ(check.subject, "G1/H1");
  EXPECT_TRUE(absl::IsCancelled(CheckLinesOfSight({group}, *block.surface, 0.5, [] { return false; }).status()));
}

TEST(Travel, NamesAxisHoleAndExcess) {
  CorrectedHoleGroup group;
  group.name = "G1";
  group.holes.resize(1);
  group.holes[0].name = "H1";
  group.holes[0].start_mm = {101.5, 0, 20};
  const std::vector<LinearTravel> travel = {{"X", Eigen::Vector3d::UnitX(), -100, 100},
                                            {"Z", Eigen::Vector3d::UnitZ(), -50, 100}};
  EXPECT_EQ(TextOf(CheckTravel({group}, {}, travel, {})), "TRAVEL of X at G1/H1: 1.5 mm, want at most 0 mm");
  group.holes[0].start_mm.x() = 99;
  EXPECT_TRUE(CheckTravel({group}, {}, travel, {}).passed());
  // The axes carry the spindle, which is above the tip by the tool's length.
  EXPECT_EQ(TextOf(CheckTravel({group}, {}, travel, {60, 90})), "TRAVEL of Z at G1/H1: 10 mm, want at most 0 mm");
  const auto moves = ReadNcProgram("G0 X0 Y0 Z0 A0 B0\nZ120\n", {'A', 'B'}, {});
  EXPECT_EQ(TextOf(CheckTravel({group}, *moves, travel, {})), "TRAVEL of Z at line 2: 20 mm, want at most 0 mm");
}

}  // namespace
}  // namespace sixpoint::metrology
