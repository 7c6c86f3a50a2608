// What a control holds beside the program, as it was stated: for what writes programs and for what reads them back.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>

#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::metrology {

struct NcFrame {
  // Machine less program coordinates while the code is in force: "G54" to "G59"; X, Y, Z in mm, the two rotary axes in deg.
  std::map<std::string, std::array<double, 5>> work_offsets;
  // By number: how far the tool's tip is below the spindle, mm, and what G43 H with that number adds. Where any is stated, a
  // program's coordinates are the tip's while the length of the tool in the spindle is in force, and off by it while not. Where none
  // is, they are the tip's always.
  std::map<int, double> tool_lengths_mm;
  // What the control calls X, Y, Z, the axis on the bed and the one that it carries: a letter, or a letter with a number, which has = before its
  // value ("C1" in "C1=90"). Empty: X, Y, Z and the letters of the machine.
  std::array<std::string, 5> axis_words;
  // The rotary axes of the control's own five-axis transformation: while it is on (TRAORI), X, Y, Z are of the part as it lies at zero, and
  // A3, B3, C3 the tool's direction from its tip to its holder, on the part too. None: a program that switches it on is refused.
  std::optional<RotaryAxes> transformation;

  std::array<std::string, 5> WordsOf(const std::array<char, 2>& rotary) const {
    if (!axis_words[0].empty()) return axis_words;
    return {"X", "Y", "Z", std::string(1, rotary[0]), std::string(1, rotary[1])};
  }
};

}  // namespace sixpoint::metrology
