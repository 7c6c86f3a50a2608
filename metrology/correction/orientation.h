// The rotary angles that turn a direction of the part onto machine +Z (docs/methods/correction.md, angles).
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>

#include "metrology/kinematics/rotary_axes.h"
#include "metrology/kinematics/two_turns.h"

namespace sixpoint::metrology {

struct RotaryAngles {
  double a_rad = 0;
  double b_rad = 0;
};

struct RotaryLimits {
  double a_minimum_rad = 0, a_maximum_rad = 0;
  double b_minimum_rad = 0, b_maximum_rad = 0;
};

// On identified axes, whatever their directions: R_A(a) R_B(b) direction = +Z, by NearestTurns (two_turns.h). With A along Y and B along X
// it is the paper's closed form. Of both branches and their whole turns, the one within the limits nearest to `near`.
// FAILED_PRECONDITION when the direction lies along the B axis and no tilt is allowed, Z along the A axis or the two axes are parallel
// (singular), OUT_OF_RANGE when no angles turn it onto +Z (unreachable, with the angle that it misses by), or none within the limits.
// Near the B axis it swings no farther than has to be for the tilt between the turned direction and +Z to be as allowed.
absl::StatusOr<RotaryAngles> Orient(const RotaryAxes& axes, const Eigen::Vector3d& direction_in_zero,
                                    const RotaryAngles& near, const RotaryLimits& limits, double allowed_tilt_rad = 0);

// Between +Z and the direction, turned by these angles.
double TiltOf(const RotaryAxes& axes, const Eigen::Vector3d& direction_in_zero, const RotaryAngles& angles);

}  // namespace sixpoint::metrology
