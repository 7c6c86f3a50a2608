// A shape that was found, judged by the blank as it truly is and by a surface made anew.
#pragma once

#include "bench/shape/blade_blanks.h"

namespace sixpoint::bench {

struct Vane {
  std::shared_ptr<const metrology::Surface> surface;
  metrology::DesignPlaces places, patches, judged, peer;
};

struct JudgedShape {
  double allowance_mm = 1e9;  // least stock beyond what is asked, at the places of patches
  double between_mm = 1e9;    // at places of a finer grid, which no patch held
  double beyond_band_mm = 0, fixed_mm = 0, step_mm = 0, true_step_mm = 0, kink_rad = 0;

  void Take(const JudgedShape& other);  // the worse of each
};

JudgedShape Judge(const Vane& vane, const BladeCase& blade, const metrology::Reconstruction& made);

}  // namespace sixpoint::bench
