// Programs that lead the tool along a path: proven, refused by name, and divided.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "metrology/correction/nc_program.h"
#include "metrology/correction/nc_proof.h"
#include "metrology/correction/nc_remaining.h"
#include "tests/metrology/correction/changed_text.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A path of four poses between two holes, each with all five axes elsewhere.
std::map<std::string, NcTarget> TargetsOfPath() {
  std::map<std::string, NcTarget> targets = {{"G1/H1", {10.1234, 5.2345, -12.4321, 1.9123, -40.2468}},
                                             {"G2/H1", {-3.5234, 8.1345, -20.1321, -7.4123, 15.2468}}};
  for (int k = 1; k <= 4; ++k)
    targets["F1/" + std::to_string(k)] = {
        20.1234 + 0.5 * k, 4.2345 + 0.1 * k, -11.4321 - 0.05 * k, 2.9123 + 1.5 * k, -38.2468 - 0.7 * k, "F1", k};
  return targets;
}

// Begun from above at its first pose, each pose by a feed of all five axes, left upwards.
std::string Path() {
  std::string program =
      "G0 A0.0000 B0.0000 (SIXPOINT F1/1)\nX0.0000 Y0.0000 (SIXPOINT F1/1)\nG1 Z0.0000 F20 (SIXPOINT F1/1)\nM62 P1\n";
  for (int k = 2; k <= 4; ++k)
    program += "G1 X0.0000 Y0.0000 Z0.0000 A0.0000 B0.0000 F5 (SIXPOINT F1/" + std::to_string(k) + ")\n";
  return program + "M63 P1\nG0 Z50\n";
}
std::string Hole(const std::string& name) {
  const std::string mark = " (SIXPOINT " + name + ")\n";
  return "G0 A0.0000 B0.0000" + mark + "X0.0000 Y0.0000" + mark + "G1 Z0.0000 F20" + mark + "G0 Z50\n";
}
std::string Whole(const std::string& path = Path()) {
  return "G90 G21\nG0 Z50\n" + Hole("G1/H1") + path + Hole("G2/H1") + "G0 Z100\nM30\n";
}

std::string Written(const std::string& nc_template) {
  const auto written = ReplaceCoordinates(nc_template, TargetsOfPath());
  EXPECT_TRUE(written.ok()) << written.status();
  return written.ok() ? *written : "";
}
std::string ProvenPath(const std::string& nc_template,
                       const std::map<std::string, NcTarget>& targets = TargetsOfPath()) {
  const auto moves = ReadNcProgram(Written(nc_template), {'A', 'B'}, {});
  if (!moves.ok()) return "not read: " + std::string(moves.status().message());
  const auto proof = ProveProgram(*moves, targets, RotaryAxes());
  return proof.ok() ? "proven" : "not proven: " + std::string(proof.status().message());
}

std::string Line(int number) {
  return "G1 X0.0000 Y0.0000 Z0.0000 A0.0000 B0.0000 F5 (SIXPOINT F1/" + std::to_string(number) + ")\n";
}
TEST(NcPath, IsProvenFromPoseToPose) {
  EXPECT_EQ(ProvenPath(Whole()), "proven");
  // Down by rapid, as a hole may be; up by feed.
  EXPECT_EQ(ProvenPath(Whole(With(Path(), "G1 Z0.0000", "G0 Z0.0000"))), "proven");
  EXPECT_EQ(ProvenPath(Whole(With(Path(), "G0 Z50", "G1 Z50"))), "proven");
  // A path that is all that there is.
  std::map<std::string, NcTarget> alone = TargetsOfPath();
  alone.erase("G1/H1");
  alone.erase("G2/H1");
  EXPECT_EQ(ProvenPath("G90 G21\nG0 Z50\n" + Path() + "M30\n", alone), "proven");
}

TEST(NcPath, RefusesPosesThatAreSkippedSwappedOrTwice) {
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(3), ""))),
              HasSubstr("line 12: from F1/2 to F1/4, want a feed (G1) to F1/3, marked"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(2) + Line(3), Line(3) + Line(2)))), HasSubstr("from F1/1 to F1/3"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(3), Line(3) + Line(3)))), HasSubstr("from F1/3 to F1/3"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(4), ""))), HasSubstr("from F1/3 without a marker"));
  EXPECT_THAT(ProvenPath(Whole(Path() + Path())), HasSubstr("F1/1 for the second time"));
}

TEST(NcPath, RefusesOtherMovesWithinIt) {
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(3), With(Line(3), "G1", "G0")))),
              HasSubstr("a rapid (G0) from F1/2 to F1/3, want a feed (G1)"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(3), "G0 Z50\n" + Line(3)))), HasSubstr("from F1/2 without a marker"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(3), "G1 X30\n" + Line(3)))), HasSubstr("from F1/2 without a marker"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(3), "G91 G1 Z-1\nG90\n" + Line(3)))),
              HasSubstr("from F1/2 without a marker"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(3), "G1 X0.0000 Y0.0000 Z0.0000 A0.0000 B0.0000 (SIXPOINT G2/H1)\n"))),
              HasSubstr("from F1/2 to G2/H1"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(3), With(Line(3), "G1", "G2 I1 J0")))), HasSubstr("an arc"));
  EXPECT_THAT(ProvenPath("G64 P0.01\n" + Whole()), HasSubstr("a path tolerance"));
  // An axis that the block does not say stays at the pose before.
  for (const char* word : {"X0.0000 ", "Y0.0000 ", "Z0.0000 ", "A0.0000 ", "B0.0000 "})
    EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(3), With(Line(3), word, "")))), HasSubstr("cuts away from F1/3"));
  // Only the marked block's words are corrected.
  EXPECT_THAT(ProvenPath(Whole(With(Path(), Line(3), With(Line(3), " (SIXPOINT F1/3)", "")))),
              HasSubstr("from F1/2 without a marker"));
}

TEST(NcPath, IsBegunAtItsFirstPoseFromAbove) {
  const std::string begin = Path().substr(0, Path().find("M62"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), begin + "M62 P1\n" + Line(2), Line(2)))),
              HasSubstr("F1/2 without a feed from the pose before it"));
  // All axes at once, or from the side.
  EXPECT_THAT(ProvenPath(Whole(With(Path(), begin, "G0 " + Line(1).substr(3)))),
              HasSubstr("F1/1 is not reached from above"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), begin,
                                    "G0 A0.0000 B0.0000 X0.0000 (SIXPOINT F1/1)\nZ0.0000 (SIXPOINT F1/1)\n"
                                    "G1 Y0.0000 (SIXPOINT F1/1)\n"))),
              HasSubstr("not proven"));
  // From below.
  EXPECT_THAT(
      ProvenPath(Whole(With(Path(), "G1 Z0.0000 F20 (SIXPOINT F1/1)", "G0 Z-30\nG1 Z0.0000 F20 (SIXPOINT F1/1)"))),
      HasSubstr("not proven"));
}

TEST(NcPath, IsLeftUpwardsFromItsLastPose) {
  EXPECT_THAT(ProvenPath(Whole(With(Path(), "G0 Z50\n", "G0 X0\nG0 Z50\n"))), HasSubstr("not upwards from F1/4"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), "G0 Z50\n", "G91 G1 Z-1\nG90 G0 Z50\n"))),
              HasSubstr("not upwards from F1/4"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), "G0 Z50\n", ""))), HasSubstr("not upwards from F1/4"));
  EXPECT_THAT(ProvenPath(Whole(With(Path(), "G0 Z50\n", "G91 G0 Z5\nZ-6\nG90 G0 Z50\n"))), HasSubstr("not proven"));
  std::map<std::string, NcTarget> alone = TargetsOfPath();
  alone.erase("G1/H1");
  alone.erase("G2/H1");
  EXPECT_THAT(ProvenPath("G90 G21\nG0 Z50\n" + With(Path(), "G0 Z50\n", "") + "M30\n", alone),
              HasSubstr("ends at F1/4"));
}

TEST(NcPath, IsWholeAmongTheTargets) {
  std::map<std::string, NcTarget> targets = TargetsOfPath();
  targets.erase("F1/2");
  EXPECT_THAT(ProvenPath(Whole(), targets), HasSubstr("targets[F1/4].number: 4, want 1 to 3 without a gap"));
  targets = TargetsOfPath();
  targets["F1/2"].number = 3;
  EXPECT_THAT(ProvenPath(Whole(), targets), HasSubstr("targets[F1/2]: F1/3, want a pose under its own name"));
  targets = TargetsOfPath();
  targets["F1/H1"] = {};
  EXPECT_THAT(ProvenPath(Whole(), targets), HasSubstr("targets[F1/H1]"));
}

// The same pose by the axes, but a turn of the engaged tool to the next one.
TEST(NcPath, RefusesAWholeTurnBesideItsAngles) {
  const std::string axes = "G0 A0.0000 B0.0000 (SIXPOINT F1/1)\n";
  for (const char* turn : {"A360", "A-360", "B360"})
    EXPECT_THAT(ProvenPath(Whole(With(Path(), axes, axes + "G91 G0 " + turn + "\nG90\n"))),
                HasSubstr("cuts away from F1/1"));
  EXPECT_THAT(ProvenPath(Whole(With(With(Path(), axes, axes + "G91 G0 A360\nG90\n"), "G1 Z0.0000", "G0 Z0.0000"))),
              HasSubstr("not proven"));
  // Once it was left, the axes may turn.
  EXPECT_EQ(ProvenPath(Whole(Path() + "G91 G0 A360\nG90\n")), "proven");
}

TEST(NcPath, IsLeftAsHighAsItWasEnteredFrom) {
  const auto left_by = [](const std::string& blocks) { return ProvenPath(Whole(With(Path(), "G0 Z50\n", blocks))); };
  // Two micrometres, and sideways in the surface.
  EXPECT_THAT(left_by("G91 G0 Z0.002\nG90 G0 X0\nG0 Z50\n"),
              HasSubstr("not upwards from F1/4, want Z raised first, to 50 at least"));
  EXPECT_THAT(left_by("G0 Z49.99\nG0 A5\nG0 Z50\n"), HasSubstr("not upwards from F1/4"));
  EXPECT_THAT(left_by("G0 Z49\n"), HasSubstr("not upwards from F1/4"));  // another hole's block
  EXPECT_THAT(left_by("G0 Z40\nG0 Z39\nG0 Z50\n"), HasSubstr("not upwards from F1/4"));
  EXPECT_EQ(left_by("G91 G1 Z2\nG0 Z3\nG90 G0 Z50\n"), "proven");
  EXPECT_EQ(left_by("G0 Z60\n"), "proven");
  // It is where it came down along Z from that counts, in however many blocks.
  const std::string lower = With(Path(), "G1 Z0.0000", "G0 Z-11\nG1 Z0.0000");
  EXPECT_EQ(ProvenPath(Whole(lower)), "proven");
  EXPECT_THAT(ProvenPath(Whole(With(lower, "G0 Z50", "G0 Z-11\nX0\nG0 Z50"))), HasSubstr("not upwards from F1/4"));
  std::map<std::string, NcTarget> alone = TargetsOfPath();
  alone.erase("G1/H1");
  alone.erase("G2/H1");
  EXPECT_THAT(ProvenPath("G90 G21\nG0 Z50\n" + With(Path(), "G0 Z50\n", "G0 Z49\n") + "M30\n", alone),
              HasSubstr("ends at F1/4"));
}

// The part turns so far that the last pose stands above where the first one was entered from.
TEST(NcPath, IsLeftAsFarAboveAHigherLastPose) {
  std::map<std::string, NcTarget> targets = {{"F1/1", {1, 2, -10, 0, 0, "F1", 1}},
                                             {"F1/2", {1, 2, 30, 40, 0, "F1", 2}}};
  const auto left_to = [&](const std::string& blocks) {
    const auto written = ReplaceCoordinates(
        "G90 G21\nG0 Z15\nG0 A0.0000 B0.0000 (SIXPOINT F1/1)\nX0.0000 Y0.0000 (SIXPOINT F1/1)\n"
        "G1 Z0.0000 F20 (SIXPOINT F1/1)\n" +
            Line(2) + blocks + "G0 X0\nM30\n",
        targets);
    EXPECT_TRUE(written.ok()) << written.status();
    const auto moves = ReadNcProgram(*written, {'A', 'B'}, {});
    EXPECT_TRUE(moves.ok()) << moves.status();
    return std::string(ProveProgram(*moves, targets, RotaryAxes()).status().message());
  };
  EXPECT_EQ(left_to("G0 Z55\n"), "");
  EXPECT_THAT(left_to("G0 Z30.01\n"), HasSubstr("to 55 at least"));
}

// A control wakes up in G0 or in G1.
TEST(NcPath, IsCutOnlyOnceG1WasSaid) {
  std::map<std::string, NcTarget> targets = TargetsOfPath();
  targets.erase("G2/H1");
  const std::string hole = "X0.0000 Y0.0000 Z0.0000 A0.0000 B0.0000 F5 (SIXPOINT G1/H1)\nZ50\n";
  std::string path = Path();
  for (const char* word : {"G0 ", "G1 "})
    for (std::size_t at; (at = path.find(word)) != std::string::npos;) path.erase(at, 3);
  const std::string program = "G90 G21\n" + hole + path + "M30\n";
  EXPECT_THAT(ProvenPath(program, targets), HasSubstr("no G1 said before, from F1/1 to F1/2, want a feed (G1)"));
  EXPECT_EQ(ProvenPath(With(program, "X0.0000", "G1 X0.0000"), targets), "proven");
}

TEST(NcPath, KeepsItsTool) {
  const auto moves_of = [](const std::string& path) {
    NcFrame frame;
    frame.tool_lengths_mm = {{1, 100}, {2, 90}};
    return ReadNcProgram(Written("T1 M6\n" + With(Whole(path), "G0 Z50", "G43 H1 G0 Z50")), {'A', 'B'}, frame);
  };
  const auto proven = [&](const std::string& path) {
    const auto moves = moves_of(path);
    EXPECT_TRUE(moves.ok()) << moves.status();
    return std::string(ProveProgram(*moves, TargetsOfPath(), RotaryAxes()).status().message());
  };
  EXPECT_EQ(proven(Path()), "");
  EXPECT_THAT(proven(With(Path(), Line(3), "T2 M6\nG43 H2\n" + Line(3))), HasSubstr("not all axes are known at F1/2"));
  EXPECT_THAT(proven(With(Path(), "M63 P1\n", "M63 P1\nT2 M6\nG43 H2\n")), HasSubstr("not upwards from F1/4"));
}

// By where the moves end alone: what was written to be a pose is one where all five axes are there.
int PoseAt(const NcPosition& at) {
  for (int k = 1; k <= 4; ++k) {
    const NcTarget target = TargetsOfPath()["F1/" + std::to_string(k)];
    const std::array<double, 5> wanted = {target.x_mm, target.y_mm, target.z_mm, target.a_deg, target.b_deg};
    bool same = true;
    for (std::size_t i = 0; i < 5; ++i) same = same && at[i].has_value() && std::abs(*at[i] - wanted[i]) < 2e-4;
    if (same) return k;
  }
  return 0;
}

// Lines taken out, moved, doubled, or with another word at random: refused, or the poses follow each other, each once, by feeds.
TEST(NcPath, WhatIsProvenGoesFromPoseToPose) {
  std::mt19937_64 random(17);
  int proven = 0;
  for (int i = 0; i < 6000; ++i) {
    std::vector<NcLine> lines = LinesOf(Whole());
    const std::size_t at = random() % lines.size(), to = random() % lines.size();
    const std::size_t letter = lines[at].text.find_first_of("GXYZABM");
    switch (random() % 5) {
      case 0:
        lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(at));
        break;
      case 1:
        std::swap(lines[at], lines[to]);
        break;
      case 2:
        lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(to), NcLine(lines[at]));
        break;
      case 3:
        lines[at].text.insert(0, random() % 2 == 0 ? "G0 " : "G1 ");
        break;
      default:
        if (letter != std::string::npos) lines[at].text.erase(letter, lines[at].text.find(' ', letter) - letter);
    }
    std::string nc_template;
    for (const NcLine& line : lines) nc_template += line.text;
    const auto written = ReplaceCoordinates(nc_template, TargetsOfPath());
    if (!written.ok()) continue;
    const auto moves = ReadNcProgram(*written, {'A', 'B'}, {});
    if (!moves.ok() || !ProveProgram(*moves, TargetsOfPath(), RotaryAxes()).ok()) continue;
    ++proven;
    std::vector<int> poses;
    for (std::size_t m = 0; m < moves->size(); ++m) {
      const NcMove& move = moves->at(m);
      const int pose = PoseAt(move.to);
      if (move.switches_on || pose == 0) continue;
      poses.push_back(pose);
      EXPECT_TRUE(pose == 1 ? OnlyZ(move) : move.feed && PoseAt(move.from) == pose - 1) << nc_template;
      if (pose < 4) continue;
      std::size_t next = m + 1;
      while (next < moves->size() && moves->at(next).switches_on) ++next;
      ASSERT_LT(next, moves->size());
      double height_mm = *move.to[2];
      for (; height_mm < 50 && next < moves->size(); height_mm = *moves->at(next++).to[2])
        ASSERT_TRUE(OnlyZ(moves->at(next)) && *moves->at(next).to[2] > height_mm) << nc_template;
    }
    EXPECT_EQ(poses, (std::vector<int>{1, 2, 3, 4})) << nc_template;
  }
  EXPECT_GT(proven, 300);
}

// Each of the three cut, and every two.
TEST(NcPath, IsLeftOutAsOne) {
  const std::set<std::string> poses = {"F1/1", "F1/2", "F1/3", "F1/4"};
  const std::string program = Written(Whole());
  for (int mask = 0; mask < 7; ++mask) {
    std::set<std::string> cut;
    if ((mask & 1) != 0) cut.insert("G1/H1");
    if ((mask & 2) != 0) cut.insert(poses.begin(), poses.end());
    if ((mask & 4) != 0) cut.insert("G2/H1");
    std::map<std::string, NcTarget> left = TargetsOfPath();
    for (const std::string& name : cut) left.erase(name);
    const auto remaining = LeaveOut(program, cut, {'A', 'B'}, {}, TargetsOfPath());
    ASSERT_TRUE(remaining.ok()) << mask << remaining.status();
    const auto proof = ProveProgram(remaining->moves, left, RotaryAxes());
    ASSERT_TRUE(proof.ok()) << mask << proof.status() << "\n" << remaining->program;
    for (const std::string& name : cut) EXPECT_THAT(remaining->program, Not(HasSubstr(name)));
  }
  for (const auto& part : {std::set<std::string>{"F1/1"}, {"F1/2", "F1/3"}, {"G1/H1", "F1/4"}}) {
    const auto status = LeaveOut(program, part, {'A', 'B'}, {}, TargetsOfPath()).status();
    EXPECT_TRUE(absl::IsFailedPrecondition(status));
    EXPECT_THAT(std::string(status.message()), HasSubstr("poses cut, want all or none"));
  }
}

}  // namespace
}  // namespace sixpoint::metrology
