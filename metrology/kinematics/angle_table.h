// How far an axis really turns: its error over angle and direction of travel, periodic in a turn
// (docs/methods/frames.md, angle table).
#pragma once

#include <absl/status/status.h>

#include <vector>

namespace sixpoint::metrology {

// How the axis came to where it stands. Unknown: the mean of both ways.
enum class Travel { kUnknown, kForward, kBackward };

// Reached minus commanded, at equal steps from 0 over a turn; linear in between.
struct AngleTable {
  std::vector<double> forward_rad;   // coming from smaller angles
  std::vector<double> backward_rad;  // as many

  // OK, or INVALID_ARGUMENT: at least 4 values a way, as many both ways, finite, each within 0.1 rad.
  absl::Status Check() const;
  double ErrorAt(double commanded_rad, Travel travel) const;
  double Reached(double commanded_rad, Travel travel) const { return commanded_rad + ErrorAt(commanded_rad, travel); }
  // The command that reaches an angle.
  double CommandFor(double reached_rad, Travel travel) const;
};

}  // namespace sixpoint::metrology
