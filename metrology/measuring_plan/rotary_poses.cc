#include "metrology/measuring_plan/rotary_poses.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace sixpoint::metrology {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kAlike_rad = 0.5 * kPi / 180;

// The chain's solver counts from the part to the tool: what the bed's joint carries comes first.
RotaryPose PoseOf(const TurnAngles& turns) { return {turns.second_rad, turns.first_rad}; }

double Nearest(double angle_rad, double minimum_rad, double maximum_rad) {
  // The limit that fewer degrees lead to, whichever way round.
  const auto away = [&](double limit_rad) { return std::abs(std::remainder(limit_rad - angle_rad, 2 * kPi)); };
  return away(minimum_rad) <= away(maximum_rad) ? minimum_rad : maximum_rad;
}

std::optional<TurnAngles> Bounded(const TurnAngles& angles, const TurnLimits& limits) {
  const auto first = WithinLimits(angles.first_rad, 0, limits.first_minimum_rad, limits.first_maximum_rad);
  const auto second = WithinLimits(angles.second_rad, 0, limits.second_minimum_rad, limits.second_maximum_rad);
  if (!first || !second) return std::nullopt;
  return TurnAngles{*first, *second};
}

// One joint at its limit, the other as near as it comes.
std::optional<TurnAngles> HeldAtLimit(const ChainSolver& solver, const Eigen::Vector3d& direction,
                                      const TurnAngles& exact, WhichTurn held, double greatest_tilt_rad) {
  const TurnLimits& limits = solver.limits();
  const bool first = held == WhichTurn::kFirst;
  const double minimum = first ? limits.first_minimum_rad : limits.second_minimum_rad;
  const double maximum = first ? limits.first_maximum_rad : limits.second_maximum_rad;
  if (!std::isfinite(minimum) || !std::isfinite(maximum)) return std::nullopt;
  const double at = Nearest(first ? exact.first_rad : exact.second_rad, minimum, maximum);
  const auto bounded = Bounded(WithHeld(solver.turns(), solver.axis_in_tool(), direction, held, at), limits);
  if (!bounded || !(TiltOf(solver.turns(), solver.axis_in_tool(), direction, *bounded) <= greatest_tilt_rad))
    return std::nullopt;
  return bounded;
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
    for (int k = 0; k < branches.count; ++k) {
      const TurnAngles& exact = branches.angles[static_cast<std::size_t>(k)];
      if (branches.miss_rad > greatest_tilt_rad) continue;
      if (const auto bounded = Bounded(exact, solver.limits())) {
        add(*bounded);
        continue;
      }
      for (const WhichTurn held : {WhichTurn::kFirst, WhichTurn::kSecond})
        if (const auto turns = HeldAtLimit(solver, direction, exact, held, greatest_tilt_rad)) add(*turns);
    }
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
