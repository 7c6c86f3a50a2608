// Rows of holes whose starts, axes and diameters are known, measured by pins or by their bores in worlds that are as the model has them
// or harsher, and how often what is stated of them holds. The truth is told from the drawn geometry alone, not by the kernel's formulas.
#pragma once

#include <map>
#include <random>
#include <string>

#include "tests/metrology/inspection/pinned_block.h"

namespace sixpoint::metrology {

struct HoleWorld {
  std::string name;
  bool bores = false;     // of 2 mm, instead of pins of 0.44 mm
  double play_mm = 0;     // as far as gauge pins stand loose, leaning somehow; 0: tight ones without a certificate
  double outliers = 0;    // share of the points that lie up to 0.3 mm off
  double heavy_mm = 0;    // beside the noise, of one point in five
  double waver_mm = 0;    // of the pin's or the bore's wall, round it and along it
  double bend_mm = 0;     // of a pin, at its top
  bool one_side = false;  // seen from three views of six
  bool chips = false;     // at every second hole: 40 points of one beside the pin, or on the floor of the bore
  bool floor = false;     // the bores end 1.5 mm deep, seen to their floors; drawn deeper
  double pitch_mm = 1.5;
  double casting_mm = 0;  // waver of the surface beside the holes
};

struct ValueTally {
  int count = 0, held = 0;
  double squares = 0, expanded_squares = 0;
  void Add(double error, double expanded);
  double held_percent() const { return count > 0 ? 100.0 * held / count : 0; }
  double rms() const;
  double expanded() const;  // rms of the stated ones
};

struct WorldTally {
  std::map<std::string, ValueTally> values;  // mm, rad
  // Of the pitch, what both holes' expanded uncertainties would add up to if nothing were common.
  ValueTally independent_pitch;
  int holes = 0, measured = 0;
  std::string why;  // the last one was not
};

// Each seed draws a row of four holes, calibrations of 12 degrees of freedom and a pose that follow their errors, and the scans.
WorldTally RunHoleWorld(const HoleWorld& world, int seeds, int first_seed = 0);

}  // namespace sixpoint::metrology
