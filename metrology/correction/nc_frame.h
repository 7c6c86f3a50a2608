// What a control holds beside the program, as it was stated: for what writes programs and for what reads them back.
#pragma once

#include <array>
#include <map>
#include <string>

namespace sixpoint::metrology {

struct NcFrame {
  // Machine less program coordinates while the code is in force: "G54" to "G59"; X, Y, Z in mm, the two rotary axes in deg.
  std::map<std::string, std::array<double, 5>> work_offsets;
  // By number: how far the tool's tip is below the spindle, mm, and what G43 H with that number adds. Where any is stated, a
  // program's coordinates are the tip's while the length of the tool in the spindle is in force, and off by it while not. Where none
  // is, they are the tip's always.
  std::map<int, double> tool_lengths_mm;
};

}  // namespace sixpoint::metrology
