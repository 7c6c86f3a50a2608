// Chords by jaws and lines that touch a section from outside.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "metrology/sections/camber.h"
#include "metrology/sections/outline.h"

namespace sixpoint::metrology {

struct Chord {
  double length_mm = 0;
  Eigen::Vector2d along;  // unit; which of the two ways is the caller's
};

enum class ChordFault { kNone, kNoDoubleTangent, kContactNotSeen };
struct FoundChord {
  std::optional<Chord> chord;
  ChordFault fault = ChordFault::kNone;
};

// The two places of the outline that are farthest from each other.
FoundChord CaliperChord(const Outline& outline);

// The line that touches the outline at two places on the side that the camber line bows away from; the length is the outline's extent along it.
FoundChord TangentChord(const Outline& outline, const Camber& camber);

}  // namespace sixpoint::metrology
