#include "metrology/measuring_plan/rotary_poses.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

constexpr double kAlike_rad = 0.5 * kPi / 180;

// The chain's solver counts from the part to the tool: what the bed's joint carries comes first.
RotaryPose PoseOf(const TurnAngles& turns) { return {turns.second_rad, turns.first_rad}; }

// The whole turn within the limits, or the limit that fewer degrees lead to, whichever way round.
double HeldWithin(double angle_rad, double minimum_rad, double maximum_rad) {
  if (const auto within = WithinLimits(angle_rad, 0, minimum_rad, maximum_rad)) return *within;
  const auto away = [&](double limit_rad) { return std::abs(std::remainder(limit_rad - angle_rad, 2 * kPi)); };
  return away(minimum_rad) <= away(maximum_rad) ? minimum_rad : maximum_rad;
}

std::optional<TurnAngles> Bounded(const TurnAngles& angles, const TurnLimits& limits) {
  const auto first = WithinLimits(angles.first_rad, 0, limits.first_minimum_rad, limits.first_maximum_rad);
  const auto second = WithinLimits(angles.second_rad, 0, limits.second_minimum_rad, limits.second_maximum_rad);
  if (!first || !second) return std::nullopt;
  return TurnAngles{*first, *second};
}

// One joint at a limit, the other as near as it comes: of all four limits what leaves the least tilt.
std::optional<TurnAngles> NearestAtALimit(const ChainSolver& solver, const Eigen::Vector3d& direction,
                                          double greatest_tilt_rad) {
  const TurnLimits& limits = solver.limits();
  std::optional<TurnAngles> nearest;
  double least_rad = greatest_tilt_rad;
  for (const auto& [held, at_rad] : {std::pair(WhichTurn::kFirst, limits.first_minimum_rad),
                                     {WhichTurn::kFirst, limits.first_maximum_rad},
                                     {WhichTurn::kSecond, limits.second_minimum_rad},
                                     {WhichTurn::kSecond, limits.second_maximum_rad}}) {
    if (!std::isfinite(at_rad)) continue;
    TurnAngles turns = WithHeld(solver.turns(), solver.axis_in_tool(), direction, held, at_rad);
    turns.first_rad = HeldWithin(turns.first_rad, limits.first_minimum_rad, limits.first_maximum_rad);
    turns.second_rad = HeldWithin(turns.second_rad, limits.second_minimum_rad, limits.second_maximum_rad);
    const double tilt_rad = TiltOf(solver.turns(), solver.axis_in_tool(), direction, turns);
    if (tilt_rad <= least_rad && (!nearest || tilt_rad < least_rad)) least_rad = tilt_rad, nearest = turns;
  }
  return nearest;
}

}  // namespace

std::vector<RotaryPose> PosesTowards(const ChainSolver& solver, const std::vector<Eigen::Vector3d>& directions_in_zero,
                                     double greatest_tilt_rad) {
  std::vector<RotaryPose> poses;
  const auto add = [&](const TurnAngles& turns) {
    const RotaryPose pose = PoseOf(turns);
    const bool known = std::any_of(poses.begin(), poses.end(), [&](const RotaryPose& other) {
      return std::abs(other.a_rad - pose.a_rad) < kAlike_rad && std::abs(other.b_rad - pose.b_rad) < kAlike_rad;
    });
    if (!known) poses.push_back(pose);
  };
  for (const Eigen::Vector3d& direction : directions_in_zero) {
    const TurnBranches branches = BranchesOf(solver.turns(), solver.axis_in_tool(), direction);
    bool within = false;
    for (int k = 0; k < branches.count && branches.miss_rad <= greatest_tilt_rad; ++k)
      if (const auto bounded = Bounded(branches.angles[static_cast<std::size_t>(k)], solver.limits())) {
        add(*bounded);
        within = true;
      }
    if (within) continue;
    if (const auto turns = NearestAtALimit(solver, direction, greatest_tilt_rad)) add(*turns);
  }
  return poses;
}

double TiltWithoutLimits(const ChainSolver& solver, const Eigen::Vector3d& direction_in_zero) {
  return BranchesOf(solver.turns(), solver.axis_in_tool(), direction_in_zero).miss_rad;
}

std::vector<Eigen::Vector3d> DirectionsAround(int count) {
  const double golden_rad = kPi * (3 - std::sqrt(5.0));
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, across = std::sqrt(1 - z * z);
    directions.emplace_back(across * std::cos(golden_rad * i), across * std::sin(golden_rad * i), z);
  }
  return directions;
}

}  // namespace sixpoint::metrology
