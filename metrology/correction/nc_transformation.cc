#include "metrology/correction/nc_transformation.h"

#include <cmath>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/two_turns.h"

namespace sixpoint::metrology {
namespace {

constexpr double kNotOne = 1e-3, kAsNear_rad = 1 * kRadPerDeg;

}  // namespace

absl::StatusOr<std::array<double, 5>> AxesOfDirection(
    const RotaryAxes& axes, const Eigen::Vector3d& point_on_part_mm, const Eigen::Vector3d& direction_on_part,
    const std::array<double, 2>& from_deg, const std::function<absl::Status(const std::string& wanted)>& wrong) {
  if (!(std::abs(direction_on_part.norm() - 1) <= kNotOne)) return wrong("A3, B3 and C3 of length 1");
  const TurnAngles from{from_deg[0] * kRadPerDeg, from_deg[1] * kRadPerDeg};
  const TurnChoices turns = NearestTurns({axes.a.direction, axes.b.direction}, direction_on_part.normalized(),
                                         Eigen::Vector3d::UnitZ(), from, TurnLimits());
  if (turns.branches.free != WhichTurn::kNone || turns.branches.narrow_sine < kSingularAngle_rad)
    return wrong("a direction that is not along a rotary axis, which is free there");
  if (turns.count == 0) return wrong("a direction that the rotary axes reach");
  const auto distance_rad = [&](const TurnAngles& angles) {
    return std::hypot(angles.first_rad - from.first_rad, angles.second_rad - from.second_rad);
  };
  if (turns.count > 1 && distance_rad(turns.choices[1].angles) - distance_rad(turns.choices[0].angles) < kAsNear_rad)
    return wrong("a direction of which one pose is the nearest; two are as near");
  const TurnAngles& angles = turns.choices[0].angles;
  const Eigen::Vector3d tip_mm = axes.MachineFromZero(angles.first_rad, angles.second_rad) * point_on_part_mm;
  return std::array<double, 5>{tip_mm.x(), tip_mm.y(), tip_mm.z(), angles.first_rad / kRadPerDeg,
                               angles.second_rad / kRadPerDeg};
}

}  // namespace sixpoint::metrology
