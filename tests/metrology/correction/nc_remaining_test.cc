// What is left of a program: carried out, it does to the holes that are left what the whole one does, and nothing to the others.
#include "metrology/correction/nc_remaining.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "metrology/correction/nc_program.h"
#include "metrology/correction/nc_proof.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::map<std::string, NcTarget> SixHoles() {
  std::map<std::string, NcTarget> targets;
  for (int i = 0; i < 6; ++i) {
    const double group = i / 3;
    targets["G" + std::to_string(i / 3 + 1) + "/H" + std::to_string(i % 3 + 1)] = {
        10.0 + 2 * i, 5 + 0.1 * i, -12 + group, 1.9 - 9 * group, -40 + 55 * group};
  }
  return targets;
}

std::string Words(const NcTarget& t, const char* letters) {
  std::string words;
  for (const char* l = letters; *l != 0; ++l) {
    char text[32];
    std::snprintf(text, sizeof text, "%c%.4f ", *l,
                  *l == 'X'   ? t.x_mm
                  : *l == 'Y' ? t.y_mm
                  : *l == 'Z' ? t.z_mm
                  : *l == 'A' ? t.a_deg
                              : t.b_deg);
    words += text;
  }
  return words;
}

std::string DrillOfSixHoles() {
  std::string program = "%\nO0100\nG21 G90\nS9000 M3\nG0 Z100\n", group;
  for (const auto& [name, t] : SixHoles()) {
    const std::string mark = "(SIXPOINT " + name + ")\n";
    if (name.substr(0, 2) != group) program += "G0 Z100\nG0 " + Words(t, "AB") + mark;
    group = name.substr(0, 2);
    program += "G0 " + Words(t, "XY") + mark + mark + "G1 " + Words(t, "Z") +
               "F20\nG91 G1 Z-2.5\nG90 G1 Z-5.0000 F50\nG0 Z30\n";
  }
  // Out of a hole by feed to -5: above every start.
  return program + "G0 Z100\nM5\nM30\n%\n";
}

std::string LaserOfSixHoles() {
  std::string program = "G90 G21\n";
  for (const auto& [name, t] : SixHoles())
    program += "G0 Z50\n" + Words(t, "ABXY") + "(SIXPOINT " + name + ")\nG1 " + Words(t, "Z") + "F200 (SIXPOINT " +
               name + ")\nM62 P1\nG4 P0.2\nM63 P1\n";
  return program + "G0 Z50\nM2\n";
}

// Of every way to have cut some of the holes.
void EveryPartIsProven(const std::string& program) {
  const auto targets = SixHoles();
  const auto whole = ReadNcProgram(program, {'A', 'B'}, {});
  ASSERT_TRUE(whole.ok()) << whole.status();
  ASSERT_TRUE(ProveProgram(*whole, targets, RotaryAxes()).ok()) << ProveProgram(*whole, targets, RotaryAxes()).status();
  for (int mask = 1; mask < 63; ++mask) {
    std::set<std::string> cut;
    std::map<std::string, NcTarget> left = targets;
    int i = 0;
    for (const auto& [name, target] : targets)
      if ((mask >> i++ & 1) != 0) {
        cut.insert(name);
        left.erase(name);
      }
    const auto remaining = LeaveOut(program, cut, {'A', 'B'}, {});
    ASSERT_TRUE(remaining.ok()) << mask << " " << remaining.status();
    const auto proof = ProveProgram(remaining->moves, left, RotaryAxes());
    ASSERT_TRUE(proof.ok()) << mask << " " << proof.status() << "\n" << remaining->program;
    for (const std::string& name : cut) EXPECT_THAT(remaining->program, Not(HasSubstr(name)));
    // Never lower on the way than the whole program is.
    for (const NcMove& move : remaining->moves)
      if (move.target.empty() && !move.feed && !move.by_steps && !move.switches_on && move.to[2]) {
        EXPECT_GE(*move.to[2], 30) << mask;
      }
  }
}

TEST(NcRemaining, EveryPartOfADrillsProgramIsProven) { EveryPartIsProven(DrillOfSixHoles()); }
TEST(NcRemaining, EveryPartOfALasersProgramIsProven) { EveryPartIsProven(LaserOfSixHoles()); }

TEST(NcRemaining, WithoutCutsItIsTheProgram) {
  const auto remaining = LeaveOut(DrillOfSixHoles(), {}, {'A', 'B'}, {});
  ASSERT_TRUE(remaining.ok()) << remaining.status();
  EXPECT_EQ(remaining->program, DrillOfSixHoles());
}

std::string Refusal(const std::string& program, const std::string& cut) {
  const auto remaining = LeaveOut(program, {cut}, {'A', 'B'}, {});
  return remaining.ok() ? "divided:\n" + remaining->program : std::string(remaining.status().message());
}

// What a hole's blocks leave in force for the next one's cannot go with them.
TEST(NcRemaining, RefusesWhereWhatStaysWouldDoOtherwise) {
  const std::string first = "G90\nG0 Z50\nA1 B2 X1 Y2 (SIXPOINT G1/H1)\nG1 Z0 F20 (SIXPOINT G1/H1)\nG0 Z50\n";
  const std::string next = "X3 Y2 (SIXPOINT G1/H2)\nG1 Z0 F20 (SIXPOINT G1/H2)\nG0 Z50\nM30\n";
  // The angles once for the group, with its first hole.
  const auto turned_by_the_first = LeaveOut(first + next, {"G1/H1"}, {'A', 'B'}, {});
  ASSERT_TRUE(turned_by_the_first.ok());
  EXPECT_THAT(
      std::string(ProveProgram(turned_by_the_first->moves, {{"G1/H2", {3, 2, 0, 1, 2}}}, {}).status().message()),
      HasSubstr("cuts away from G1/H2"));
  EXPECT_THAT(Refusal(first + next, "G1/H2"), HasSubstr("divided"));
  // In a block of its own the turn is the next hole's.
  EXPECT_THAT(
      Refusal(
          "G90\nG0 Z50\nA1 B2 (sixpoint  G1/H1)\nX1 Y2 (SIXPOINT G1/H1)\nG1 Z0 F20 (SIXPOINT G1/H1)\nG0 Z50\n" + next,
          "G1/H1"),
      "divided:\nG90\nG0 Z50\nA1 B2 (sixpoint  G1/H2)\n" + next);
  const std::string turned = "A1 B2 " + next;
  EXPECT_THAT(Refusal(first + turned, "G1/H1"), HasSubstr("divided"));
  // The feed's rate, and that it is one.
  EXPECT_THAT(Refusal(first + "A1 B2 X3 Y2 (SIXPOINT G1/H2)\nG1 Z0 (SIXPOINT G1/H2)\nM30\n", "G1/H1"),
              HasSubstr("another way"));
  EXPECT_THAT(Refusal("G90\nG0 Z50\nA1 B2 X1 Y2 (SIXPOINT G1/H1)\nG1 Z0 F20 (SIXPOINT G1/H1)\nZ50\n"
                      "A1 B2 X3 Y2 F20 (SIXPOINT G1/H2)\nZ0 (SIXPOINT G1/H2)\nM30\n",
                      "G1/H1"),
              HasSubstr("another way"));
  // The spindle, and the tool.
  EXPECT_THAT(
      Refusal("G90\nG0 Z50\nA1 B2 X1 Y2 M3 (SIXPOINT G1/H1)\nG1 Z0 F20 (SIXPOINT G1/H1)\nG0 Z50\n" + turned, "G1/H1"),
      HasSubstr("line 3: M3 among the blocks of G1/H1"));
  EXPECT_THAT(
      Refusal("G90\nG0 Z50\nA1 B2 X1 Y2 S500 (SIXPOINT G1/H1)\nG1 Z0 F20 (SIXPOINT G1/H1)\nG0 Z50\n" + turned, "G1/H1"),
      HasSubstr("line 3: S500 among the blocks of G1/H1"));
}

TEST(NcRemaining, RefusesWhatWouldBeLeftOtherwise) {
  const std::string h2 = "A1 B2 X3 Y2 (SIXPOINT G1/H2)\nG1 Z0 F20 (SIXPOINT G1/H2)\nG0 Z50\nM30\n";
  // A retract that would be a plunge: nothing says where the tool is before the first hole.
  EXPECT_THAT(Refusal("G90\nG0 A1 B2 X1 Y2 (SIXPOINT G1/H1)\nG1 Z0 F20 (SIXPOINT G1/H1)\nG0 Z5\n" + h2, "G1/H1"),
              HasSubstr("line 4: a retract from where nobody knows"));
  EXPECT_THAT(
      Refusal("G90\nG0 Z50\nA1 B2 X1 Y2 (SIXPOINT G1/H1)\nG94 G1 Z0 F20 (SIXPOINT G1/H1)\nG0 Z50\n" + h2, "G1/H1"),
      HasSubstr("G94 among the blocks of G1/H1"));
  EXPECT_THAT(
      Refusal("G90\nG0 Z50\nA1 B2 X1 Y2 (SIXPOINT G1/H1)\nG1 Z0 F20 (SIXPOINT G1/H1)\nM62 P1\nG0 Z50\n" + h2, "G1/H1"),
      HasSubstr("an output stays on after G1/H1"));
  EXPECT_THAT(
      Refusal("G90\nM62 P1\nG0 Z50\nA1 B2 X1 Y2 (SIXPOINT G1/H1)\nG1 Z0 F20 (SIXPOINT G1/H1)\nM63 P1\nG0 Z50\n" + h2,
              "G1/H1"),
      HasSubstr("switches off what another block switched on"));
}

// Lines taken out of and put into sound programs at random: refused, or what is left does what it did.
TEST(NcRemaining, WhatStaysDoesWhatItDid) {
  std::mt19937_64 random(5);
  int divided = 0;
  for (int i = 0; i < 2000; ++i) {
    std::vector<NcLine> lines = LinesOf(i % 2 == 0 ? DrillOfSixHoles() : LaserOfSixHoles());
    for (int k = 0; k < 2; ++k) {
      const std::size_t at = random() % lines.size(), to = random() % lines.size();
      if (random() % 2 == 0)
        lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(at));
      else
        lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(to), NcLine(lines[at]));
    }
    std::string program;
    for (const NcLine& line : lines) program += line.text;
    const auto whole = ReadNcProgram(program, {'A', 'B'}, {});
    if (!whole.ok()) continue;
    const std::string cut = "G" + std::to_string(random() % 2 + 1) + "/H" + std::to_string(random() % 3 + 1);
    const auto remaining = LeaveOut(program, {cut}, {'A', 'B'}, {});
    if (!remaining.ok()) continue;
    ++divided;
    // Every move that is left is one of the whole program's, in its order.
    auto next = whole->begin();
    for (const NcMove& move : remaining->moves) {
      const auto same = [&](const NcMove& other) {
        return other.feed == move.feed && other.by_steps == move.by_steps && other.switches_on == move.switches_on &&
               (other.target == move.target || other.target == cut);
      };
      next = std::find_if(next, whole->end(), same);
      ASSERT_NE(next, whole->end()) << program << "\n----\n" << remaining->program;
      ++next;
      EXPECT_NE(move.target, cut);
    }
  }
  EXPECT_GT(divided, 400);
}

// Without the G1 of the hole before it a control that wakes up in G0 goes to the next one by rapid.
TEST(NcRemaining, RefusesAFeedThatNothingSaysAnyMore) {
  const std::map<std::string, NcTarget> targets = SixHoles();
  const auto hole = [&](const std::string& motion, const std::string& name) {
    return motion + Words(targets.at(name), "XYZAB") + "F20 (SIXPOINT " + name + ")\n";
  };
  const auto left = [&](const std::string& motion) {
    return LeaveOut("G90 G21\n" + hole("G1 ", "G1/H1") + hole(motion, "G1/H2") + "G0 Z100\nM30\n", {"G1/H1"},
                    {'A', 'B'}, {}, targets)
        .status();
  };
  EXPECT_THAT(std::string(left("").message()), HasSubstr("would move another way"));
  EXPECT_TRUE(left("G1 ").ok()) << left("G1 ");
}

}  // namespace
}  // namespace sixpoint::metrology
