// The rotary angles that turn a direction of the part onto machine +Z (docs/methods/correction.md, angles).
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>

#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::metrology {

struct RotaryAngles {
  double a_rad = 0;
  double b_rad = 0;
};

struct RotaryLimits {
  double a_minimum_rad = 0, a_maximum_rad = 0;
  double b_minimum_rad = 0, b_maximum_rad = 0;
};

// A direction nearer than this to the inner axis is singular: the inner angle is then free, or as good as free (an error
// of the direction is multiplied by more than a thousand in it).
inline constexpr double kSingularAngle_rad = 1e-3;
// Nearer than this to the inner axis, and where the inner angle would have to go farther than that from `near`, the angles may leave a
// tilt instead.
inline constexpr double kNearSingular_rad = 5 * 3.14159265358979323846 / 180;
inline constexpr double kLongSwing_rad = 3 * 3.14159265358979323846 / 180;

// On identified axes, whatever their directions: R_A(a) R_B(b) direction = +Z by the two-axis closed form (Paden and Kahan's
// second subproblem). With A along Y and B along X it is the paper's. Of both branches and their whole turns, the one within the
// limits nearest to `near`. FAILED_PRECONDITION when the direction lies along the B axis and no tilt is allowed, Z along the A axis or the
// two axes are parallel (singular), OUT_OF_RANGE when no angles turn it onto +Z (unreachable), or none within the limits.
// Near the B axis it swings no farther than has to be for the tilt between the turned direction and +Z to be as allowed.
absl::StatusOr<RotaryAngles> Orient(const RotaryAxes& axes, const Eigen::Vector3d& direction_in_zero,
                                    const RotaryAngles& near, const RotaryLimits& limits, double allowed_tilt_rad = 0);

// Between +Z and the direction, turned by these angles.
double TiltOf(const RotaryAxes& axes, const Eigen::Vector3d& direction_in_zero, const RotaryAngles& angles);

}  // namespace sixpoint::metrology
