#include "metrology/correction/nc_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

std::vector<NcMove> MovesOf(const std::string& program, const NcFrame& frame = {}) {
  const auto moves = ReadNcProgram(program, {'A', 'B'}, frame);
  EXPECT_TRUE(moves.ok()) << moves.status();
  return moves.ok() ? *moves : std::vector<NcMove>();
}

std::string RefusalOf(const std::string& program) {
  const auto moves = ReadNcProgram(program, {'A', 'B'});
  return moves.ok() ? "read" : std::string(moves.status().message());
}

TEST(NcReader, FollowsWhatIsInForce) {
  const auto moves = MovesOf(
      "%\nO0100 (X9)\nN10 G21 G90 G17 G40 G49 G80 T1 M06\nG0 A1.5 B-2 S9000 M3\nX1. Y.5 (SIXPOINT G1/H1)\n"
      "(SIXPOINT G1/H1)\n; and on\nG01Z-2F20\nG91 Z-1\nG90 Z30\nM30\n%\n");
  ASSERT_EQ(moves.size(), 5u);
  EXPECT_EQ(moves[0].to, (NcPosition{std::nullopt, std::nullopt, std::nullopt, 1.5, -2.0}));
  EXPECT_FALSE(moves[0].feed);
  EXPECT_EQ(moves[1].target, "G1/H1");
  EXPECT_EQ(moves[1].to, (NcPosition{1.0, 0.5, std::nullopt, 1.5, -2.0}));
  EXPECT_EQ(moves[2].line, 8);
  EXPECT_EQ(moves[2].target, "G1/H1");
  EXPECT_TRUE(moves[2].feed);
  EXPECT_EQ(moves[3].to[2], -3.0);
  EXPECT_TRUE(moves[3].by_steps);
  EXPECT_EQ(moves[3].target, "");
  EXPECT_EQ(moves[4].to[2], 30.0);
  EXPECT_TRUE(moves[4].feed);
}

TEST(NcReader, KnowsUnitsAndOffsetsThatAreStated) {
  EXPECT_EQ(MovesOf("G20 G0 X1 A10")[0].to[0], 25.4);
  EXPECT_EQ(MovesOf("G20 G0 X1 A10")[0].to[3], 10.0);
  NcFrame frame;
  frame.work_offsets["G55"] = {100, 0, -5, 0, 0.5};
  const auto moves = MovesOf("G55 G0 X1 Z1 B1\nG53 G0 Z0\nG500 X1", frame);
  EXPECT_EQ(moves[0].to, (NcPosition{101.0, std::nullopt, -4.0, std::nullopt, 1.5}));
  EXPECT_EQ(moves[1].to[2], 0.0);
  EXPECT_EQ(moves[2].to[0], 1.0);
}

NcFrame TwoTools() {
  NcFrame frame;
  frame.tool_lengths_mm = {{1, 120.5}, {2, 80}};
  return frame;
}

TEST(NcReader, ALengthInForceMakesCoordinatesTheTips) {
  const auto moves = MovesOf(
      "T1 M6\nG0 Z100\nG43 H01 Z50\nG43 H2 Z50\nG91 Z-1\nG90 G49 Z50\nG53 Z0\nT2 M6\nX1\nG43 H2 Z5\n", TwoTools());
  EXPECT_EQ(moves[0].to[2], 100 - 120.5);      // no length in force: the spindle is sent there
  EXPECT_EQ(moves[1].to[2], 50.0);             // its own length
  EXPECT_EQ(moves[2].to[2], 50 + 80 - 120.5);  // another tool's
  EXPECT_EQ(moves[3].to[2], 50 + 80 - 121.5);
  EXPECT_EQ(moves[4].to[2], 50 - 120.5);
  EXPECT_EQ(moves[5].to[2], -120.5);
  EXPECT_EQ(moves[6].to[2], std::nullopt);  // another tool: its tip is elsewhere
  EXPECT_EQ(moves[7].to[2], 5.0);
}

TEST(NcReader, WithoutAToolNothingIsKnownOfTheTip) {
  const auto moves = MovesOf("G0 Z100\nG43 H2\nG0 Z50\n", TwoTools());
  EXPECT_EQ(moves[0].to[2], std::nullopt);
  EXPECT_EQ(moves[1].to[2], 50.0);  // the tool is the one whose length is taken
}

TEST(NcReader, RefusesLengthsThatAreNotStated) {
  const auto refusal = [](const std::string& program) {
    const auto moves = ReadNcProgram(program, {'A', 'B'}, TwoTools());
    return moves.ok() ? "read" : std::string(moves.status().message());
  };
  EXPECT_THAT(RefusalOf("G43 H1 Z1"), HasSubstr("want H1 stated with the tool's length"));
  EXPECT_THAT(refusal("G43 H3 Z1"), HasSubstr("want H3 stated"));
  EXPECT_THAT(refusal("G43 H1.5 Z1"), HasSubstr("want H1.5 stated"));
  EXPECT_THAT(refusal("G43 H9999999999 Z1"), HasSubstr("stated"));
  EXPECT_THAT(refusal("T3 M6"), HasSubstr("want T3 stated"));
  EXPECT_THAT(refusal("M6"), HasSubstr("want a T for its M6"));
  EXPECT_THAT(refusal("G43 Z1"), HasSubstr("want G43 with its H"));
  EXPECT_THAT(refusal("H1"), HasSubstr("want no H but with G43"));
  EXPECT_THAT(refusal("G43 G49 H1"), HasSubstr("want one of G43 and G49"));
  EXPECT_THAT(refusal("G43.4 H1"), HasSubstr("want no H but with G43"));
  EXPECT_THAT(refusal("G44 H1"), HasSubstr("want no H but with G43"));
}

TEST(NcReader, AfterAReturnToTheReferenceNothingIsKnownOfThoseAxes) {
  const auto moves = MovesOf("G0 X1 Y2 Z3 A4 B5\nG91 G28 Z0\nG28");
  EXPECT_EQ(moves[1].to, (NcPosition{1.0, 2.0, std::nullopt, 4.0, 5.0}));
  EXPECT_EQ(moves[2].to, NcPosition{});
}

// By a point that nobody looked at.
TEST(NcReader, RefusesAReturnOverAPoint) {
  EXPECT_THAT(RefusalOf("G28 Z10"), HasSubstr("want G28 and G30 of all axes, or by no step"));
  EXPECT_THAT(RefusalOf("G91 G30 Z-1"), HasSubstr("by no step"));
  EXPECT_EQ(RefusalOf("G91 G28 Z0"), "read");
}

TEST(NcReader, RefusesWhatItDoesNotUnderstand) {
  for (const char* line : {"G2 X1 Y1",   "G3 I1 J1",
                           "G1 X1 R5",   "G2 G3 X1 R5",
                           "G2.1 X1 R5", "G64 Q1 R1",
                           "G5 X1",      "G10 L2 P1 X0",
                           "G18",        "G19",
                           "G41 D1",     "G43 H1",
                           "G43.4 H1",   "G51 X2",
                           "G51.1 X0",   "G52 X1",
                           "G54",        "G54.1 P1",
                           "G59.1",      "G65 P100",
                           "G66 P1",     "G68 X0 Y0 R10",
                           "G68.2 X0",   "G81 Z-1 R1",
                           "G83 Z-1 Q1", "G92 X0",
                           "G92.1",      "G93.5",
                           "G96 S10",    "M98 P1000",
                           "M99",        "M97 P1",
                           "M128",       "M198 P1",
                           "TRAORI",     "TRANS X1",
                           "ROT Z10",    "CYCLE800(0)",
                           "GOTO 10",    "IF [#1 EQ 1] GOTO 5",
                           "WHILE",      "X#1",
                           "X[1+2]",     "X=5",
                           "#1=5",       "R1=5",
                           "L10",        "X1 X2",
                           "G0 G1 X1",   "G90 G91 X1",
                           "/X1",        "X1.2.3",
                           "X1-2",       "X--1",
                           "C5",         "U1",
                           "W1",         "H1",
                           "D1",         "Q1",
                           "E5",         "I1",
                           "P1",         "G4 X1.",
                           "O1 X1",      "X1 (never closed",
                           "X1E3",       "X1 & Y2",
                           "M3.5",       ":100",
                           "x1\rY2"})
    EXPECT_THAT(RefusalOf(std::string("G21 G90\n") + line + "\n"), HasSubstr("nc_template: line 2: ")) << line;
  EXPECT_THAT(RefusalOf("M30\nX1"), HasSubstr("line 2"));
  // A megabyte in one block is refused at once.
  std::string many;
  for (int i = 0; i < 400'000; ++i) many += "G1";
  EXPECT_THAT(RefusalOf(many), HasSubstr("at most 16 G words in a block"));
  EXPECT_THAT(RefusalOf("X1\n(SIXPOINT G1/H1)\n"), HasSubstr("a block after the marker of G1/H1"));
  EXPECT_THAT(RefusalOf("(SIXPOINT G1/H1)\nM8\n"), HasSubstr("a word of an axis in a marked block"));
  EXPECT_THAT(RefusalOf("(SIXPOINT G1/H1)\nX1 (SIXPOINT G1/H2)"), HasSubstr("one marker for a block"));
  EXPECT_THAT(RefusalOf("(SIXPOINT)\nX1"), HasSubstr("a marker (SIXPOINT group/hole)"));
}

// Its ends, with what is in force; where it goes between is nobody's hole (nc_proof.h).
TEST(NcReader, FollowsArcsToTheirEnds) {
  const auto moves = MovesOf("G91.1 G64 P0.005 Q0.01\nG0 X1 Y2 Z3 A4 B5\nG2 X2 Y1 R5\nG91 X1 I0.5 J0\nG1 Z-1");
  ASSERT_EQ(moves.size(), 4u);
  EXPECT_FALSE(moves[0].arc);
  EXPECT_TRUE(moves[1].arc && moves[1].feed);
  EXPECT_EQ(moves[1].to, (NcPosition{2.0, 1.0, 3.0, 4.0, 5.0}));
  EXPECT_TRUE(moves[2].arc);
  EXPECT_EQ(moves[2].to, (NcPosition{3.0, 1.0, 3.0, 4.0, 5.0}));
  EXPECT_FALSE(moves[3].arc);
  EXPECT_EQ(moves[1].path_tolerance_mm, 0.127);
  EXPECT_THAT(RefusalOf("G91 G2 G28 Z0 R5"), HasSubstr("no arc (G2, G3) beside G28"));
  EXPECT_THAT(RefusalOf("G2 X1 R5\nG91 G28 Z0 R5"), HasSubstr("no R5 but of an arc"));
  EXPECT_THAT(RefusalOf("G91 G2 G28 Z0"), HasSubstr("no arc (G2, G3) beside G28"));
  EXPECT_EQ(RefusalOf("G2 X1 R5\nG91 G28 Z0"), "read");
  EXPECT_THAT(RefusalOf("G2 X1 R5\nX2"), HasSubstr("line 2: \"X2\", want an arc's centre or radius"));
}

TEST(NcReader, TakesHarmlessWords) {
  EXPECT_EQ(
      RefusalOf("\xef\xbb\xbf%\r\nG04 P1.5\r\nN5 G64 G97 G94 G98 M8\r\nT2 M6\r\nM62 P1\r\n( X1 [ # )\r\nM2\r\n%\r\n"),
      "read");
}

}  // namespace
}  // namespace sixpoint::metrology
