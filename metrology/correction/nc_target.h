// Where a program has to take a hole.
#pragma once

namespace sixpoint::metrology {

// The hole's start in machine coordinates and the commands of the machine's two rotary axes: what the words of a marked block become.
struct NcTarget {
  double x_mm = 0, y_mm = 0, z_mm = 0;
  double a_deg = 0, b_deg = 0;
};

}  // namespace sixpoint::metrology
