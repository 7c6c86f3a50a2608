// Rows of thin pins that stand close on a block, as a scanner sees them: some are missing, some stand loosely, some are not the pins
// that they are said to be, a casting stands proud beside them; each hides what is behind it.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "tests/metrology/inspection/pinned_block.h"

namespace sixpoint::metrology {

struct PinRow {
  double hole_diameter_mm = 0.3;
  double pitch_over_diameter = 2;
  double missing_share = 0.1;
  double proud_mm = 0;    // of the casting, round each hole
  double play_share = 0;  // of the drawing's diameter, by which the pins are thinner: each leans somehow in its hole
  double oversize_share = 0;  // of the drawing's diameter, by which the holes are wider
  bool calibrated = false;    // the pins' diameter and play are stated, and how deep they stand
  double depth_mm = 6;        // so deep
  double stranger_share = 0;  // of the pins, those of another diameter than the others: thinner by up to a fifth
};

struct StandingPins {
  std::vector<InspectedHole> holes;
  std::vector<SimulatedPin> bores;  // of each hole: where it was drilled
  std::vector<SimulatedPin> pins;   // those that stand
  std::vector<int> pin_of;          // of each hole, its pin; -1: none
  std::vector<bool> strange;        // of each pin
  bool play_known = true;           // to the inspection: stated, or as the drawing has it
};

// Ten holes, drilled some hundredths of a millimetre off: most within 0.03 mm and 0.5 deg, their tolerances.
StandingPins PutPins(const PinRow& row, std::mt19937_64* random);

// Scanned from six sides and judged.
absl::StatusOr<BladeFindings> InspectRow(const PinRow& row, const StandingPins& standing, std::mt19937_64* random);

struct PinTally {
  int standing = 0, measured = 0, strange = 0, wrong = 0;
  int inside = 0;                   // of the measured, those whose position error is within the expanded uncertainty
  std::vector<std::string> claims;  // that are wrong
  void Add(const PinTally& other);
};

// What is said of the holes against where they are. Wrong: a hole without a pin is measured; CONFORM where it is out of a tolerance by
// more than half of U, NOT_CONFORM where it is within by as much; or, where the play is known, it is farther from where it is said to
// be than 1.5 times what is stated and 2 um.
PinTally JudgeRow(const StandingPins& standing, const BladeFindings& findings);

}  // namespace sixpoint::metrology
