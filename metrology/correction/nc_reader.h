// What a control does with a machining program, read apart from what writes one (nc_program.h): the two share no code, so that a fault
// of the one is not a fault of the other. What is understood stands in docs/nc_template.md; every other word is refused.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "metrology/correction/nc_frame.h"

namespace sixpoint::metrology {

// The tip's X, Y, Z in mm and the machine's two rotary axes in deg, as commanded, machine coordinates; none where the program does
// not say.
inline constexpr std::size_t kNcAxisCount = 5, kNcZ = 2;
using NcPosition = std::array<std::optional<double>, kNcAxisCount>;

// A block that moves axes, or switches an output on where they stand.
struct NcMove {
  int line = 0;              // of the program, from 1
  bool feed = false;         // cutting feed (G1 to G3), or no word yet says which; else rapid (G0)
  bool arc = false;          // G2, G3: `from` and `to` are its ends
  bool by_steps = false;     // G91
  bool switches_on = false;  // M62, M64: a laser's or a generator's shot; from and to are the same
  std::string target;        // group/hole of its marker; empty: not marked
  NcPosition from, to;
  std::optional<double> rate;  // F in force; none: not said yet
  // G64 P in force: so far it may pass beside its ends, at most (as inches, whatever the unit). 0: none is stated, and the control's own
  // exactness holds.
  double path_tolerance_mm = 0;
  bool by_direction =
      false;  // A3, B3, C3 said where the tool points: the control's transformation turned the axes (nc_frame.h)
  bool motion_said = false;  // a G0 to G3 is in force; else the control goes as it woke up, by rapid or feed
};

// Whether no other axis than Z moves.
bool OnlyZ(const NcMove& move);

// The reader's version, stored with what it proved.
inline constexpr char kNcReaderVersion[] = "4";

// The program's lines are its template's, and refusals name that. rotary: the letters of the axis on the bed, and of the one that
// it carries. INVALID_ARGUMENT, naming the line, for any word, mode, offset or tool that is not understood, and for a marker with no
// block.
absl::StatusOr<std::vector<NcMove>> ReadNcProgram(const std::string& program, const std::array<char, 2>& rotary,
                                                  const NcFrame& frame = {});

}  // namespace sixpoint::metrology
