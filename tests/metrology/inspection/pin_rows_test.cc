// Rows of thin pins that stand close: none is taken for its neighbour's, what beside a hole is no pin spoils none, and what a pin
// cannot tell of its hole is in the uncertainty.
#include "tests/metrology/inspection/pin_rows.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace sixpoint::metrology {
namespace {

PinTally Judged(const PinRow& row, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const StandingPins standing = PutPins(row, &random);
  const auto findings = InspectRow(row, standing, &random);
  EXPECT_TRUE(findings.ok()) << findings.status();
  if (!findings.ok()) return {};
  PinTally tally = JudgeRow(standing, *findings);
  for (const std::string& claim : tally.claims) ADD_FAILURE() << claim;
  return tally;
}

// Four rows, by seeds from that one on.
PinTally JudgedFour(const PinRow& row, std::uint64_t seed) {
  PinTally tally;
  for (std::uint64_t i = 0; i < 4; ++i) tally.Add(Judged(row, seed + i));
  return tally;
}

TEST(PinRows, NoneIsTakenForItsNeighbours) {
  for (const double diameter_mm : {0.1, 0.2, 0.3, 0.4, 0.5}) {
    PinTally tally;
    for (const double pitch : {2.0, 2.5, 3.0}) {
      PinRow row;
      row.hole_diameter_mm = diameter_mm;
      row.pitch_over_diameter = pitch;
      tally.Add(JudgedFour(row, static_cast<std::uint64_t>(1000 * diameter_mm + 100 * pitch)));
    }
    std::printf("d %.1f mm: %d of %d pins measured, %d wrong\n", diameter_mm, tally.measured, tally.standing,
                tally.wrong);
    EXPECT_GE(tally.measured, tally.standing * 8 / 10) << diameter_mm;
  }
}

// A casting proud by more than the first clearance beside each hole: no pin is measured wrongly, and most are measured.
TEST(PinRows, AProudCastingSpoilsNone) {
  for (const double proud_mm : {0.16, 0.25, 0.4}) {
    PinRow row;
    row.hole_diameter_mm = 0.4;
    row.pitch_over_diameter = 3;
    row.proud_mm = proud_mm;
    const PinTally tally = JudgedFour(row, 7);
    EXPECT_GE(tally.measured, tally.standing * 9 / 10) << proud_mm;
  }
}

// Pins thinner than their holes lean in them, holes are wider than drawn: what a pin shows is not where the hole is, and what is not
// known of it is not claimed.
TEST(PinRows, ALoosePinClaimsNoMoreThanItsPlayAllows) {
  for (const bool calibrated : {false, true})
    for (const double oversize_share : {0.0, 0.15})
      for (const double play_share : {0.0, 0.05, 0.32}) {
        PinRow row;
        row.hole_diameter_mm = 0.44;
        row.pitch_over_diameter = 3;
        row.play_share = play_share;
        row.oversize_share = oversize_share;
        row.calibrated = calibrated;
        row.depth_mm = calibrated ? 2.5 : 6;
        const PinTally tally = JudgedFour(row, 20);
        EXPECT_GE(tally.measured, tally.standing * 9 / 10) << play_share << " " << oversize_share;
      }
}

// Where the pins' diameter is stated, one of another diameter measures nothing.
TEST(PinRows, APinOfAnotherDiameterMeasuresNothing) {
  PinRow row;
  row.hole_diameter_mm = 0.4;
  row.pitch_over_diameter = 3;
  row.calibrated = true;
  row.stranger_share = 0.3;
  const PinTally tally = JudgedFour(row, 40);
  EXPECT_GE(tally.strange, 5);
  EXPECT_GE(tally.measured, tally.standing * 9 / 10);
}

}  // namespace
}  // namespace sixpoint::metrology
