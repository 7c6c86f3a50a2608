// What a control holds beside the program, as it was stated: for what writes programs and for what reads them back.
#pragma once

#include <array>
#include <map>
#include <string>

namespace sixpoint::metrology {

struct NcFrame {
  // Machine less program coordinates while the code is in force: "G54" to "G59"; X, Y, Z in mm, the two rotary axes in deg.
  std::map<std::string, std::array<double, 5>> work_offsets;
};

}  // namespace sixpoint::metrology
