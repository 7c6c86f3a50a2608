// Machines of every class, and whether a solution brings the tool to its target, by forward kinematics.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/chain_solver.h"

namespace sixpoint::metrology {

// Rounding of a few hundred mm through a dozen products is 1e-12; the goal is 1e-9.
inline constexpr double kClose = 1e-9;

inline Joint Linear(const std::string& axis, const Eigen::Vector3d& direction) {
  Joint joint;
  joint.axis = axis;
  joint.motion = {JointKind::kLinear, {direction, Eigen::Vector3d::Zero()}};
  return joint;
}
inline Joint Rotary(const std::string& axis, const Eigen::Vector3d& direction, const Eigen::Vector3d& point_mm,
                    double sign = 1) {
  Joint joint;
  joint.axis = axis;
  joint.motion = {JointKind::kRotary, {direction, point_mm}};
  joint.sign = sign;
  return joint;
}
inline Joint Limited(Joint joint, double minimum, double maximum) {
  joint.minimum = minimum;
  joint.maximum = maximum;
  return joint;
}
// A machine of ours that is refused ends the test, saying why.
inline JointChain Chain(std::vector<Joint> part_side, std::vector<Joint> tool_side) {
  return JointChain::Make(std::move(part_side), std::move(tool_side)).value();
}
inline ChainSolver Solver(const JointChain& chain, const ChainSolverOptions& options = {}) {
  return ChainSolver::Make(chain, options).value();
}

inline const Eigen::Vector3d kPointC(26.6264, 54.8357, -193.1341);  // the paper's

// A about Y carries B about X; X, Y, Z move the tool. Commands: A, B, X, Y, Z.
inline JointChain Sarix() {
  return Chain({Rotary("A", Eigen::Vector3d::UnitY(), kPointC), Rotary("B", Eigen::Vector3d::UnitX(), kPointC)},
               {Linear("X", Eigen::Vector3d::UnitX()), Linear("Y", Eigen::Vector3d::UnitY()),
                Linear("Z", Eigen::Vector3d::UnitZ())});
}

// NRC's: X carries Y carries B (about Y) carries C (about Z); Z moves the tool. Commands: X, Y, B, C, Z.
// At rest the tool's frame and the workpiece's are one; B lies z12 below their origin.
inline JointChain TiltRotaryTable(double z12_mm) {
  return Chain(
      {Linear("X", Eigen::Vector3d::UnitX()), Linear("Y", Eigen::Vector3d::UnitY()),
       Rotary("B", Eigen::Vector3d::UnitY(), {0, 0, -z12_mm}), Rotary("C", Eigen::Vector3d::UnitZ(), {0, 0, 0})},
      {Linear("Z", Eigen::Vector3d::UnitZ())});
}

inline Eigen::Vector3d RandomDirection(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return Eigen::Vector3d(x, y, z).normalized();
}

// Rotary joints on the part's side: 2, 1 or 0 of the two. Axes of any direction, 15 deg or more from parallel, through points that do not
// meet; linear joints within 20 deg of X, Y and Z, anywhere on either side.
inline JointChain RandomChain(int rotary_on_part, std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-300, 300), unit(0, 1), tilt(-0.2, 0.2);
  const auto point = [&] {
    const double x = place(random), y = place(random), z = place(random);
    return Eigen::Vector3d(x, y, z);
  };
  Eigen::Vector3d first, second;
  do {
    first = RandomDirection(random);
    second = RandomDirection(random);
  } while (first.cross(second).norm() < std::sin(15 * kRadPerDeg));
  std::vector<Joint> sides[2];
  sides[rotary_on_part > 0 ? 0 : 1].push_back(Rotary("B", first, point()));
  sides[rotary_on_part > 1 ? 0 : 1].push_back(Rotary("C", second, point()));
  for (int k = 0; k < 3; ++k) {
    Eigen::Vector3d direction = Eigen::Vector3d::Unit(k);
    for (int i = 0; i < 3; ++i) direction(i) += tilt(random);
    std::vector<Joint>& side = sides[unit(random) < 0.5 ? 0 : 1];
    const auto at = static_cast<std::ptrdiff_t>(unit(random) * static_cast<double>(side.size() + 1));
    // Reachable within a machine: where a turn makes them dependent they would travel without end.
    side.insert(side.begin() + at,
                Limited(Linear(std::string(1, static_cast<char>('X' + k)), direction.normalized()), -10000, 10000));
  }
  for (std::vector<Joint>& side : sides)
    for (Joint& joint : side) joint.sign = unit(random) < 0.5 ? 1 : -1;
  return Chain(sides[0], sides[1]);
}

struct Arrival {
  double off_mm = 0, off_rad = 0;
};
inline Arrival ArrivalOf(const JointChain& chain, const MountedTool& tool, const ToolTarget& target,
                         const Eigen::VectorXd& reached) {
  const Eigen::Isometry3d zero_from_tool = chain.ZeroFromTool(reached);
  const Eigen::Vector3d axis = zero_from_tool.linear() * tool.axis_in_tool;
  return {(zero_from_tool * tool.TipInToolMm() - target.tip_in_zero_mm).norm(),
          std::atan2(axis.cross(target.axis_in_zero).norm(), axis.dot(target.axis_in_zero))};
}
// Where the tool is at these positions.
inline ToolTarget TargetAt(const JointChain& chain, const MountedTool& tool, const Eigen::VectorXd& reached) {
  const Eigen::Isometry3d zero_from_tool = chain.ZeroFromTool(reached);
  return {zero_from_tool * tool.TipInToolMm(), zero_from_tool.linear() * tool.axis_in_tool};
}

// What Solve finds from beside each branch whose linear joints reach the tip; the branch nearest to nominal first.
inline std::vector<ChainSolution> BothBranches(const ChainSolver& solver, const ToolTarget& target,
                                               const Eigen::VectorXd& nominal_commanded) {
  const TurnChoices found = NearestTurns(solver.turns(), solver.axis_in_tool(), target.axis_in_zero.normalized(),
                                         solver.ReachedTurns(nominal_commanded), solver.limits(), 0);
  std::vector<ChainSolution> solutions;
  for (int k = 0; k < found.count; ++k) {
    const TurnAngles& turns = found.choices[static_cast<std::size_t>(k)].angles;
    const auto there = solver.Place(target.tip_in_zero_mm, turns, nominal_commanded);
    if (!there.ok()) continue;
    auto solved = solver.Solve(target, solver.Commanded(*there));
    if (solved.ok()) solutions.push_back(*std::move(solved));
  }
  return solutions;
}

inline Eigen::VectorXd Values(std::vector<double> values) {
  return Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

}  // namespace sixpoint::metrology
