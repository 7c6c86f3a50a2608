#include "metrology/correction/nc_program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

const std::map<std::string, NcTarget> kTwoHoles = {{"G1/H1", {202.42981234, -68.05114, 12.3456789, 0.9585, 55.76411}},
                                                   {"G1/H2", {1, 2, 3, -0.00001, 5}}};

std::string Replaced(const std::string& text) {
  const auto result = ReplaceCoordinates(text, kTwoHoles);
  return result.ok() ? *result : "refused: " + std::string(result.status().message());
}

TEST(NcProgram, ReplacesTheWordsOfMarkedBlocksOnly) {
  EXPECT_EQ(Replaced("%\nO1 (X1 Y2)\nN10 G21 G90\nN20 A0. B55 (SIXPOINT G1/H1)\nN30 G0 X202.7765 Y67.9014 (SIXPOINT "
                     "G1/H1)\nN40 X5 Y6\n%\n"),
            "%\nO1 (X1 Y2)\nN10 G21 G90\nN20 A0.9585 B55.7641 (SIXPOINT G1/H1)\nN30 G0 X202.4298 Y-68.0511 (SIXPOINT "
            "G1/H1)\nN40 X5 Y6\n%\n");
}

TEST(NcProgram, AMarkerAloneMarksTheNextBlock) {
  EXPECT_EQ(Replaced("(SIXPOINT G1/H1)\n\n(a comment)\nG1 Z-1.5 F20\nZ-1.5\n"),
            "(SIXPOINT G1/H1)\n\n(a comment)\nG1 Z12.3457 F20\nZ-1.5\n");
  EXPECT_EQ(Replaced("X1 ; sixpoint G1/H1\nX1"), "X202.4298 ; sixpoint G1/H1\nX1");
}

TEST(NcProgram, KeepsEveryOtherByte) {
  const std::string odd =
      "\xef\xbb\xbf%\r\n\t /N1  G90\r\n( \xc3\xa4 )\r\n N2 x  1.00000 y+2. z-.5F1.5M8 (SIXPOINT G1/H1) \r\n\r\n;end";
  EXPECT_EQ(
      Replaced(odd),
      "\xef\xbb\xbf%\r\n\t /N1  G90\r\n( \xc3\xa4 )\r\n N2 x  202.42981 y-68.0511 z12.3457F1.5M8 (SIXPOINT G1/H1) "
      "\r\n\r\n;end");
}

TEST(NcProgram, WritesTheMachinesLetters) {
  const auto written = ReplaceCoordinates("X1 A5 B1 C2 (SIXPOINT G1/H1)", kTwoHoles, {'B', 'C'});
  ASSERT_TRUE(written.ok()) << written.status();
  EXPECT_EQ(*written, "X202.4298 A5 B0.9585 C55.7641 (SIXPOINT G1/H1)");
  EXPECT_THAT(std::string(ReplaceCoordinates("A5 (SIXPOINT G1/H1)", kTwoHoles, {'B', 'C'}).status().message()),
              HasSubstr("at least one of the words X Y Z B C in"));
}

TEST(NcProgram, KeepsDecimalsAndSigns) {
  EXPECT_EQ(Replaced("X1.000000 (SIXPOINT G1/H1)"), "X202.429812 (SIXPOINT G1/H1)");
  EXPECT_EQ(Replaced("X1.00000000000000 (SIXPOINT G1/H1)"), "X202.429812340 (SIXPOINT G1/H1)");
  EXPECT_EQ(Replaced("X+1 Y+1 (SIXPOINT G1/H1)"), "X+202.4298 Y-68.0511 (SIXPOINT G1/H1)");
  EXPECT_EQ(Replaced("A5 (SIXPOINT G1/H2)"), "A0.0000 (SIXPOINT G1/H2)");
}

TEST(NcProgram, RefusesNamingTheLine) {
  EXPECT_THAT(Replaced("G90\nX1 (SIXPOINT G1/H9)"), HasSubstr("line 2"));
  EXPECT_THAT(Replaced("X1 (SIXPOINT)"), HasSubstr("line 1"));
  EXPECT_THAT(Replaced("X1 (SIXPOINTED G1/H1)"), HasSubstr("want a marker"));
  EXPECT_THAT(Replaced("G1\nG1\nG1 F20 (SIXPOINT G1/H1)"), HasSubstr("line 3"));
  EXPECT_THAT(Replaced("(SIXPOINT G1/H1)\n\n"), HasSubstr("line 1"));
  EXPECT_THAT(Replaced("(SIXPOINT G1/H1)\n(SIXPOINT G1/H2)\nX1"), HasSubstr("one marker for a block"));
  EXPECT_THAT(Replaced("X1 X2 (SIXPOINT G1/H1)"), HasSubstr("the word X once"));
  for (const std::string value : {"#100", "[1+2]", "=5", "1.2.3", "--1", "", ".", "1 2", "\xff"})
    EXPECT_THAT(Replaced("G90\nX" + value + " (SIXPOINT G1/H1)"), HasSubstr("line 2")) << value;
}

TEST(NcProgram, RefusesIncrementsAndInchesInMarkedBlocksOnly) {
  EXPECT_THAT(Replaced("G91 X1 (SIXPOINT G1/H1)"), HasSubstr("G90"));
  EXPECT_THAT(Replaced("G20\nX1 (SIXPOINT G1/H1)"), HasSubstr("millimetres"));
  EXPECT_EQ(Replaced("G91 G28 Z0\nG90 X1 (SIXPOINT G1/H1)"), "G91 G28 Z0\nG90 X202.4298 (SIXPOINT G1/H1)");
}

TEST(NcProgram, RefusesATemplateWithoutMarkers) {
  EXPECT_THAT(Replaced("X1 Y2\n"), HasSubstr("no marked block"));
  EXPECT_THAT(Replaced(""), HasSubstr("no marked block"));
}

TEST(NcProgram, ATemplateIsCheckedWithoutAMachine) {
  const std::set<std::string> holes = {"G1/H1", "G1/H2"};
  const auto refusal = [&](const std::string& text) { return std::string(CheckTemplate(text, holes).message()); };
  EXPECT_EQ(refusal("C1 B2 (SIXPOINT G1/H1)\n(sixpoint G1/H2)\nX1\nM30\n"), "");  // whatever its rotary axes are called
  EXPECT_THAT(refusal("X1 (SIXPOINT G1/H1)\n"), HasSubstr("no block marked (SIXPOINT G1/H2)"));
  EXPECT_THAT(refusal("X1 (SIXPOINT G1/H1)\nX1 (SIXPOINT G1/H2)\nX1 (SIXPOINT G2/H1)\n"), HasSubstr("line 3"));
  EXPECT_THAT(refusal("X1 (SIXPOINT G1/H1)\nG91 X1 (SIXPOINT G1/H2)\n"), HasSubstr("line 2"));
  EXPECT_THAT(refusal("X1 Y2\n"), HasSubstr("no marked block"));
}

TEST(NcProgram, RefusesACoordinateThatIsNotFinite) {
  const auto result = ReplaceCoordinates("X1 (SIXPOINT G/H)", {{"G/H", {std::nan(""), 0, 0, 0, 0}}});
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace sixpoint::metrology
