// Commands of a machine that bring its tool to a point of the part along a direction: any chain with two rotary joints, on whichever
// side, and three linear joints (docs/methods/frames.md, inverse of a joint chain).
//
// Frames: zero (the part as it stands with every joint at 0) and tool, as in joint_chain.h. Units: mm and radians. Positions are in
// the order of JointChain::joints(). Commanded: what a joint is told; reached: where it then stands, by its angle table.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "metrology/kinematics/joint_chain.h"
#include "metrology/kinematics/two_turns.h"

namespace sixpoint::metrology {

// What is in the spindle, in the tool's frame: with every joint at 0 that is the machine's.
struct MountedTool {
  Eigen::Vector3d axis_in_tool = Eigen::Vector3d::UnitZ();  // unit, from the tip to the spindle
  Eigen::Vector3d gauge_in_tool_mm = Eigen::Vector3d::Zero();
  double length_mm = 0;  // from the gauge point to the tip, against the axis
  Eigen::Vector3d TipInToolMm() const { return gauge_in_tool_mm - length_mm * axis_in_tool; }
};

struct ToolTarget {
  Eigen::Vector3d tip_in_zero_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_in_zero = Eigen::Vector3d::UnitZ();  // unit, from the tip to the spindle: out of the part
};

struct ChainSolverOptions {
  MountedTool tool;
  // Linear joints that stay where the nominal commands have them: as many as there are beyond three, such as W.
  std::vector<std::string> held;
  // How each joint comes to its position, or empty where that is unknown.
  std::vector<Travel> travel;
};

struct ChainSolution {
  Eigen::VectorXd commanded;
  Eigen::VectorXd reached;  // what ZeroFromTool takes
  double tilt_rad = 0;      // left between the tool's axis and the one wanted
  std::optional<int>
      loose_joint;  // rotary: the direction does not determine it, or it stops short for a tilt that is allowed
};

// Thread-safe while it is not assigned to.
class ChainSolver {
 public:
  // INVALID_ARGUMENT with field, value and wanted for a chain that it does not know: other than two rotary joints, parallel ones, linear
  // joints other than three beside those held, dependent ones, a tool along the rotary joint nearest to it.
  static absl::StatusOr<ChainSolver> Make(const JointChain& chain, const ChainSolverOptions& options = {});

  // Of both branches and their whole turns the one within all limits whose rotary joints are nearest to the nominal commands, by the root of
  // the sum of both differences' squares; whole turns where a joint has no limits too. A rotary joint along which the direction lies stays
  // nominal. allowed_tilt_rad, near that joint and where the direction is out of reach by no more: as NearestTurns.
  // INVALID_ARGUMENT: malformed. OUT_OF_RANGE, with field, value and wanted of each: unreachable, by which angle; beyond limits, which joint
  // and by how much; linear joints dependent at these angles.
  absl::StatusOr<ChainSolution> Solve(const ToolTarget& target, const Eigen::VectorXd& nominal_commanded,
                                      double allowed_tilt_rad = 0) const;

  // The linear joints that bring the tip there with the rotary ones at these angles, and these with them: what is reached. OUT_OF_RANGE:
  // beyond the limits of a linear joint, or these are dependent at the angles. The rotary joints' own limits are not looked at.
  absl::StatusOr<Eigen::VectorXd> Place(const Eigen::Vector3d& tip_in_zero_mm, const TurnAngles& reached,
                                        const Eigen::VectorXd& nominal_commanded) const;

  const JointChain& chain() const { return chain_; }
  // From the part to the tool: R(first) R(second) tool axis = axis in zero.
  int first_joint() const { return rotary_[0]; }
  int second_joint() const { return rotary_[1]; }
  const TwoTurns& turns() const { return turns_; }
  const TurnLimits& limits() const { return limits_; }  // reached
  const Eigen::Vector3d& axis_in_tool() const { return tool_.axis_in_tool; }
  TurnAngles ReachedTurns(const Eigen::VectorXd& commanded) const;
  Eigen::VectorXd Commanded(const Eigen::VectorXd& reached) const;
  // INVALID_ARGUMENT: a direction that is not unit, what is not finite, a wrong count of commands, a tilt below 0.
  absl::Status Check(const ToolTarget& target, const Eigen::VectorXd& nominal_commanded, double allowed_tilt_rad) const;
  // Why no branch is taken.
  absl::Status Refusal(const ToolTarget& target, const TurnChoices& found, double allowed_tilt_rad) const;

 private:
  explicit ChainSolver(JointChain chain) : chain_(std::move(chain)) {}
  absl::Status SortJoints(const ChainSolverOptions& options);
  absl::Status CheckDirections() const;
  double CommandFor(int joint, double reached_rad) const;
  double Reached(int joint, double commanded_rad) const;
  Travel TravelOf(int joint) const {
    return travel_.empty() ? Travel::kUnknown : travel_.at(static_cast<size_t>(joint));
  }
  // What one side does to a point, its solved linear joints at 0, and the directions that they move it by.
  struct Side {
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();
  };
  Side Walk(int begin, int end, const Eigen::VectorXd& reached, double sense, Eigen::Matrix3d* directions) const;
  std::string Named(const std::vector<int>& joints) const;

  JointChain chain_;
  MountedTool tool_;
  std::vector<Travel> travel_;
  std::array<int, 2> rotary_{};  // from the part to the tool
  std::array<int, 3> linear_{};  // solved
  std::vector<int> held_;
  std::array<int, kMostJoints> column_{};  // of a solved joint; -1 else
  TwoTurns turns_;
  TurnLimits limits_;
};

}  // namespace sixpoint::metrology
