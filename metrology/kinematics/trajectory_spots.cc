#include "metrology/kinematics/trajectory_spots.h"

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <utility>

#include "metrology/kinematics/beyond_reach.h"

namespace sixpoint::metrology {
namespace {

// The steps that are allowed from the target before.
void AllowSteps(const ToolTarget& before, const Spot& spot_before, const ToolTarget& target,
                const Continuity& continuity, Spot* spot) {
  const double moved_mm = (target.tip_in_zero_mm - before.tip_in_zero_mm).norm();
  const double turned_rad = std::atan2(spot_before.axis_in_zero.cross(spot->axis_in_zero).norm(),
                                       spot_before.axis_in_zero.dot(spot->axis_in_zero));
  const auto step = [&](const StepBound& bound) {
    return bound.always + bound.per_mm * moved_mm + bound.per_rad * turned_rad;
  };
  // A turn and more between two targets is no other way, but the same with turns in it.
  spot->rotary_step_rad = std::fmin(step(continuity.rotary_rad), 2 * M_PI);
  spot->linear_step_mm = step(continuity.linear_mm);
}

absl::Status FindBranches(const ChainSolver& solver, const ToolTarget& target, const Eigen::VectorXd& nominal,
                          double allowed_tilt_rad, Spot* spot) {
  TurnChoices found;
  found.branches = BranchesOf(solver.turns(), solver.axis_in_tool(), spot->axis_in_zero);
  const TurnBranches& branches = found.branches;
  if (branches.miss_rad > allowed_tilt_rad) return solver.Refusal(target, found, allowed_tilt_rad);
  spot->tilt_rad = branches.miss_rad;
  // At an angle t from the axis no angle of that joint leaves more than 2 t beside what is out of reach.
  spot->free = branches.narrow == WhichTurn::kFirst &&
               (branches.narrow_sine <= kAlongAxis_rad ||
                2 * std::asin(branches.narrow_sine) + branches.miss_rad <= allowed_tilt_rad);
  if (spot->free) return absl::OkStatus();
  const TurnLimits& limits = solver.limits();
  absl::Status refusal;
  for (int k = 0; k < branches.count; ++k) {
    const TurnAngles& angles = branches.angles[static_cast<size_t>(k)];
    if (!WithinLimits(angles.first_rad, 0, limits.first_minimum_rad, limits.first_maximum_rad) ||
        !WithinLimits(angles.second_rad, 0, limits.second_minimum_rad, limits.second_maximum_rad))
      continue;
    auto reached = solver.Place(target.tip_in_zero_mm, angles, nominal);
    if (reached.ok())
      spot->branches.push_back({angles, *std::move(reached)});
    else
      refusal.Update(reached.status());
  }
  if (!spot->branches.empty()) return absl::OkStatus();
  return refusal.ok() ? solver.Refusal(target, found, allowed_tilt_rad) : refusal;
}

}  // namespace

absl::Status AtTarget(size_t target, const absl::Status& refusal) {
  return UnderField("targets[" + std::to_string(target) + "].", refusal);
}

absl::StatusOr<std::vector<Spot>> SpotsOf(const ChainSolver& solver, const std::vector<ToolTarget>& targets,
                                          const Eigen::VectorXd& nominal_commanded, const Continuity& continuity) {
  std::vector<Spot> spots(targets.size());
  for (size_t i = 0; i < targets.size(); ++i) {
    if (absl::Status status = solver.Check(targets[i], nominal_commanded, continuity.allowed_tilt_rad); !status.ok())
      return AtTarget(i, status);
    spots[i].axis_in_zero = targets[i].axis_in_zero.normalized();
    if (i > 0) AllowSteps(targets[i - 1], spots[i - 1], targets[i], continuity, &spots[i]);
    if (absl::Status status =
            FindBranches(solver, targets[i], nominal_commanded, continuity.allowed_tilt_rad, &spots[i]);
        !status.ok())
      return AtTarget(i, status);
  }
  return spots;
}

}  // namespace sixpoint::metrology
