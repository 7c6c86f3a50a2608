// One blade through a plant whose errors are drawn: the scanner is calibrated on a touched plate, the arm swings, the blade is scanned,
// registered and corrected. Every step is solved as a plant solves it, none is linearised; what the scanner's field really is has nothing
// of the polynomials that the estimator knows.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "metrology/correction/correct.h"
#include "metrology/registration/pose_fit.h"

namespace sixpoint::bench {

// Standard deviations; 0: that source is not there.
struct WorldErrors {
  double noise_mm = 0;
  double touch_offset_mm = 0;
  double field_mm = 0;
  double arm_mm = 0, arm_rad = 0;
  int arm_scans = 0;  // that its spread is learnt from; 0: it is known
  double axes_mm = 0, axes_rad = 0;
  int axes_freedom = 0;  // of what is stated of the axes; 0: it is known
  bool field_is_harsh = true;
  double scale_ratio = 0, squareness_ratio = 0;  // of the linear axes, mm in a mm
  double tool_offset_mm = 0;
  // The blade is warmer than 20 C by this. Measured by a thermometer of that standard deviation, of a material known so well; or not
  // measured, and known to be within the half range, anywhere in which it is then drawn.
  double warmer_k = 0, thermometer_k = 0, coefficient_per_k = 0, half_range_k = 0;
};

struct HoleOutcome {
  double error_um = 0, expanded_uncertainty_um = 0;
};

// Of one draw, its holes' starts. Ends the program where a step fails.
std::vector<HoleOutcome> DrawHoles(const WorldErrors& errors, std::uint64_t seed);

}  // namespace sixpoint::bench
