// A machining program made from a template by replacing coordinates, all else byte for byte (docs/nc_template.md).
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "metrology/correction/nc_frame.h"
#include "metrology/correction/nc_target.h"

namespace sixpoint::metrology {

// The letters of their words: of the axis on the bed, and of the one that it carries.
using RotaryLetters = std::array<char, 2>;

// Targets are keyed "group/hole". INVALID_ARGUMENT, naming the line, for an unknown target, a marker without a block, a
// marked block without coordinate words or with one that is twice there or not a plain number, or one that the template
// reads as increments (G91) or inches (G20, G70). Decimals stay as in the template, at least four.
// Where a stated offset is in force, it is taken off what is written. Where the control's transformation is on, the words X, Y, Z, A3, B3 and C3 of
// a marked block become the point and the direction that it turns into the target's axes (nc_frame.h).
absl::StatusOr<std::string> ReplaceCoordinates(const std::string& nc_template,
                                               const std::map<std::string, NcTarget>& targets,
                                               const RotaryLetters& rotary = {'A', 'B'}, const NcFrame& frame = {});

// Whether a template can be the program of these holes ("group/hole"): as ReplaceCoordinates refuses it, and where one of the holes is not
// marked. Without the frame's axis words, whatever the machine calls its rotary axes.
absl::Status CheckTemplate(const std::string& nc_template, const std::set<std::string>& holes,
                           const NcFrame& frame = {});

// A line of a program as the writer takes it apart.
struct NcWord {
  std::string address;  // upper case: a letter, a letter and a number ("A3"), or a name that has no value ("TRAORI")
  std::string value;
};
struct NcLine {
  std::string text;    // with its end
  std::string marker;  // the hole that it names; empty: none
  std::vector<NcWord> words;
};
std::vector<NcLine> LinesOf(const std::string& program);

}  // namespace sixpoint::metrology
