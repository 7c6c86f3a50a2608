// A program that is written from a template is proven, or refused: by hand, and by every single mutation of sound templates, judged by
// where the holes would be cut.
#include "metrology/correction/nc_proof.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "metrology/correction/nc_program.h"
#include "tests/metrology/correction/changed_text.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

const std::map<std::string, NcTarget> kThreeHoles = {{"G1/H1", {10.1234, 5.2345, -12.4321, 1.9123, -40.2468}},
                                                     {"G1/H2", {12.2234, 5.3345, -12.3321, 1.9123, -40.2468}},
                                                     {"G2/H1", {-3.5234, 8.1345, -20.1321, -7.4123, 15.2468}}};

// Proven, or why not.
std::string ProvenHoles(const std::string& nc_template, const NcFrame& frame = {}) {
  const auto written = ReplaceCoordinates(nc_template, kThreeHoles);
  if (!written.ok()) return "not written: " + std::string(written.status().message());
  const auto moves = ReadNcProgram(*written, {'A', 'B'}, frame);
  if (!moves.ok()) return "not read: " + std::string(moves.status().message());
  const auto proof = ProveProgram(*moves, kThreeHoles, RotaryAxes());
  if (!proof.ok()) return "not proven: " + std::string(proof.status().message());
  EXPECT_LE(proof->greatest_difference_um, 0.2);
  EXPECT_GE(proof->pose_count, 3);
  return "proven";
}

// A drill: turned, over the hole, down, out.
std::string Drill(const std::string& more_in_h1 = "") {
  return "%\nN10 G21 G90\nN20 G0 Z100\nN30 A1.8480 B-40.3576 (SIXPOINT G1/H1)\nN40 X10.0000 Y5.0000 (SIXPOINT G1/H1)\n"
         "(SIXPOINT G1/H1)\nN50 G1 Z-12.5000 F20\n" +
         more_in_h1 +
         "N60 Z30\n"
         "N70 G0 X12.0000 Y5.1000 (SIXPOINT G1/H2)\nN80 G1 Z-12.5000 (SIXPOINT G1/H2)\nG0 Z30\n"
         "N90 A-7.5000 B15.0000 (SIXPOINT G2/H1)\nN100 X-3.0000 Y8.0000 (SIXPOINT G2/H1)\nN110 G1 Z-20.0000 F5 "
         "(SIXPOINT G2/H1)\n"
         "G0 Z100\nM30\n%\n";
}
// A laser: all axes at once, shot where it stands.
std::string Laser() {
  return "G90 G21\nG0 A1.8480 B-40.3576 X10.0000 Y5.0000 Z-12.5000 (SIXPOINT G1/H1)\nM62\nG4 P0.2\nM63\n"
         "G0 X12.0000 Y5.1000 Z-12.5000 (SIXPOINT G1/H2)\nM62\nG4 P0.2\nM63\n"
         "G0 A-7.5000 B15.0000 X-3.0000 Y8.0000 Z-20.0000 (SIXPOINT G2/H1)\nM62\nG4 P0.2\nM63\nZ100\nM30\n";
}

TEST(NcProof, SoundProgramsAreProven) {
  EXPECT_EQ(ProvenHoles(Drill()), "proven");
  EXPECT_EQ(ProvenHoles(Laser()), "proven");
  EXPECT_EQ(ProvenHoles(Drill("G91 G1 Z-2.5 F10\nG90\n")), "proven");  // deeper by steps from the corrected start
  NcFrame zero;
  zero.work_offsets["G54"] = {};
  EXPECT_EQ(ProvenHoles("G54\n" + Drill(), zero), "proven");
}

std::string Without(std::string text, const std::string& part) {
  const std::size_t at = text.find(part);
  EXPECT_NE(at, std::string::npos) << part;
  return at == std::string::npos ? text : text.erase(at, part.size());
}
TEST(NcProof, ACutWithoutTheLengthInForceIsRefused) {
  NcFrame tools;
  tools.tool_lengths_mm = {{1, 120}, {2, 120.05}};
  EXPECT_EQ(ProvenHoles("T1 M6\nG43 H1\n" + Drill(), tools), "proven");
  EXPECT_EQ(ProvenHoles("G43 H1\n" + Drill(), tools), "proven");
  EXPECT_THAT(ProvenHoles(Drill(), tools), HasSubstr("not proven"));
  EXPECT_THAT(ProvenHoles("T1 M6\n" + Drill(), tools), HasSubstr("not proven"));
  EXPECT_THAT(ProvenHoles("T2 M6\nG43 H1\n" + Drill(), tools), HasSubstr("not proven"));  // 50 um deeper
  EXPECT_THAT(ProvenHoles("T1 M6\nG43 H1\n" + Drill("G49 "), tools), HasSubstr("not proven"));
}

TEST(NcProof, RefusesWhatWouldCutElsewhere) {
  // The finding that this was made for: A and B unmarked above marked X, Y, Z.
  EXPECT_THAT(ProvenHoles(With(Drill(), "B-40.3576 (SIXPOINT G1/H1)", "B-40.3576")), HasSubstr("cuts away from G1/H1"));
  EXPECT_THAT(ProvenHoles(Without(Drill(), "(SIXPOINT G1/H1)\nN50")), HasSubstr("a feed (G1) that is not marked"));
  EXPECT_THAT(ProvenHoles(With(Drill(), "Y5.0000 (SIXPOINT G1/H1)", "Y5.0000")), HasSubstr("cuts away from G1/H1"));
  EXPECT_THAT(ProvenHoles(With(Drill(), "N100 X-3.0000 Y8.0000", "N100 X-3.0000")), HasSubstr("cuts away from G2/H1"));
  EXPECT_THAT(ProvenHoles(With(Drill(), "(SIXPOINT G1/H2)", "(SIXPOINT G1/H1)")), HasSubstr("cuts away from G1/H2"));
  EXPECT_THAT(ProvenHoles(Drill("Z-15\n")), HasSubstr("a depth that does not follow the hole"));
  EXPECT_THAT(ProvenHoles(Drill("G91 Z-3\nG90\nG0 X20\n")), HasSubstr("sideways out of G1/H1"));
  EXPECT_THAT(ProvenHoles(Drill("G0 X20\n")), HasSubstr("sideways from G1/H1"));
  EXPECT_THAT(ProvenHoles(Drill("Z30\nG0 Z-12.5\n")), HasSubstr("a rapid below the start of G1/H1"));
  // Down its axis by rapid, and up to the start by feed.
  EXPECT_THAT(ProvenHoles(With(Drill(), "(SIXPOINT G1/H1)\nN50", "G0 Z-13\n(SIXPOINT G1/H1)\nN50")),
              HasSubstr("a rapid below the start of G1/H1"));
  EXPECT_THAT(ProvenHoles(Drill("X11\n")), HasSubstr("a feed (G1) that is not marked"));
  // A laser's shot where not all axes were sent.
  EXPECT_THAT(
      ProvenHoles(With(Laser(), "X12.0000 Y5.1000 Z-12.5000 (SIXPOINT G1/H2)", "X12.0000 Y5.1000 (SIXPOINT G1/H2)")),
      HasSubstr("an output switched on away from every hole"));
  EXPECT_THAT(ProvenHoles(With(Laser(), "A-7.5000 B15.0000 ", "")),
              HasSubstr("an output switched on away from every hole"));
  EXPECT_THAT(ProvenHoles(With(Laser(), "M62\n", "Z100\nM62\n")), HasSubstr("an output switched on away from G1/H1"));
  EXPECT_THAT(ProvenHoles(Without(With(Laser(), "A-7.5000 B15.0000 ", ""), "M62\nG4 P0.2\nM63\nZ100")),
              HasSubstr("G2/H1 is left before all axes were at it"));
  // An arc's ends may be right, and what lies between them is not.
  EXPECT_THAT(ProvenHoles(Drill("G91 G2 Z2 I0.1 J0\nG90 G1\n")), HasSubstr("an arc (G2, G3), want straight moves"));
  EXPECT_THAT(ProvenHoles(With(Drill(), "(SIXPOINT G1/H1)\nN50 G1", "(SIXPOINT G1/H1)\nN50 G3 R1")),
              HasSubstr("an arc"));
  // Past the start, as far as it likes.
  EXPECT_THAT(ProvenHoles("G64 P0.005\n" + Drill()), HasSubstr("a path tolerance (G64 P), want exact moves"));
  EXPECT_EQ(ProvenHoles("G64 P0.005\nG61\n" + Drill()), "proven");
  EXPECT_EQ(ProvenHoles("G64\n" + Drill()), "proven");
  // Steps count from the corrected start alone.
  EXPECT_THAT(ProvenHoles(Drill("Z-12.5\nG91 Z-2.5\nG90\n")), HasSubstr("a depth that does not follow the hole"));
  EXPECT_THAT(ProvenHoles("G90\nG0 A1 B1 X1 Y1 Z1 (SIXPOINT G1/H1)\n"), HasSubstr("G1/H2 is not in it"));
  EXPECT_THAT(ProvenHoles(With(Drill(), "G21 G90", "G21 G90\nG91 G28 A0 B0\nG90")), HasSubstr("proven"));
  EXPECT_THAT(ProvenHoles(With(Drill(), "N60 Z30\n", "N60 Z30\nG91 G28 A0\nG90\n")), HasSubstr("cuts away from G1/H2"));
}

}  // namespace
}  // namespace sixpoint::metrology
