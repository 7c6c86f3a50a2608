#include "metrology/correction/orientation.h"

#include <absl/status/status.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <string>

#include "metrology/frames/angles.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

std::string Text(const char* format, double first, double second = 0, double third = 0, double fourth = 0) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, first, second, third, fourth);
  return buffer;
}

absl::Status CheckUnit(const Eigen::Vector3d& direction) {
  // A hole axis has been through a rotation read from text: allow its rounding.
  if (std::abs(direction.norm() - 1) < 1e-6) return absl::OkStatus();
  return Refuse("axis_in_zero", Text("(%g, %g, %g)", direction.x(), direction.y(), direction.z()), "a unit direction");
}

TwoTurns TurnsOf(const RotaryAxes& axes) { return {axes.a.direction.normalized(), axes.b.direction.normalized()}; }

absl::Status Unreachable(const Eigen::Vector3d& v, double miss_rad) {
  return absl::OutOfRangeError(
      Text("axis_in_zero: (%.6f, %.6f, %.6f), want a direction that A and B can turn onto +Z", v.x(), v.y(), v.z()) +
      Text(" (unreachable: %.6f deg off at best)", miss_rad * kDegPerRad));
}

absl::Status NotWithin(const RotaryLimits& limits, const TurnBranches& branches) {
  const TurnAngles &one = branches.angles.front(), &last = branches.angles[branches.count == 2 ? 1 : 0];
  return absl::OutOfRangeError(
      Text("a_deg, b_deg: %.6f, %.6f", one.first_rad * kDegPerRad, one.second_rad * kDegPerRad) +
      Text(" or %.6f, %.6f, want a", last.first_rad * kDegPerRad, last.second_rad * kDegPerRad) +
      Text(" within %g..%g and b within %g..%g", limits.a_minimum_rad * kDegPerRad, limits.a_maximum_rad * kDegPerRad,
           limits.b_minimum_rad * kDegPerRad, limits.b_maximum_rad * kDegPerRad));
}

}  // namespace

double TiltOf(const RotaryAxes& axes, const Eigen::Vector3d& direction_in_zero, const RotaryAngles& angles) {
  const Eigen::Vector3d turned = axes.MachineFromZero(angles.a_rad, angles.b_rad).linear() * direction_in_zero;
  return std::atan2(turned.cross(Eigen::Vector3d::UnitZ()).norm(), turned.z());
}

absl::StatusOr<RotaryAngles> Orient(const RotaryAxes& axes, const Eigen::Vector3d& direction_in_zero,
                                    const RotaryAngles& near, const RotaryLimits& limits, double allowed_tilt_rad) {
  if (absl::Status status = CheckUnit(direction_in_zero); !status.ok()) return status;
  const Eigen::Vector3d v = direction_in_zero.normalized(), z = Eigen::Vector3d::UnitZ();
  const TwoTurns turns = TurnsOf(axes);
  if (turns.Parallel())
    return absl::FailedPreconditionError("axes: A and B are parallel, want two different directions (singular)");
  if (turns.first.cross(z).norm() < kSingularAngle_rad)
    return absl::FailedPreconditionError("axes.a: along Z, want a direction across it: A is free there (singular)");
  const TurnChoices found = NearestTurns(
      turns, v, z, {near.a_rad, near.b_rad},
      {limits.a_minimum_rad, limits.a_maximum_rad, limits.b_minimum_rad, limits.b_maximum_rad}, allowed_tilt_rad);
  // Without a tilt to spare nobody is told that B is as good as free there, and its uncertainty has no bound.
  const bool along_b = turns.second.cross(v).norm() < kSingularAngle_rad;
  if (along_b && (found.count == 0 || !(allowed_tilt_rad > 0))) {
    return absl::FailedPreconditionError(
        Text("axis_in_zero: (%.6f, %.6f, %.6f), want a direction that is not along the B axis: B is free there"
             " (singular)",
             v.x(), v.y(), v.z()));
  }
  if (found.count > 0) return RotaryAngles{found.choices[0].angles.first_rad, found.choices[0].angles.second_rad};
  return found.branches.miss_rad > allowed_tilt_rad ? Unreachable(v, found.branches.miss_rad)
                                                    : NotWithin(limits, found.branches);
}

}  // namespace sixpoint::metrology
