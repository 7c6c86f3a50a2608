// A machine as data: a chain of joints from the bed to the part, and one from the bed to the tool
// (docs/methods/frames.md, joint chain).
//
// Frames: machine (the bed's X, Y, Z); zero (where the part stands with every joint at 0, machine coordinates); tool (the
// tool likewise). Units: mm and radians. Joint lines are given with every joint at 0, in machine coordinates; each moves
// all that lie farther out.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "metrology/kinematics/angle_table.h"
#include "metrology/kinematics/axis_line.h"

namespace sixpoint::metrology {

enum class JointKind { kLinear, kRotary };

// What a joint does to all that it carries; a positive position moves along the direction, or turns about it by the right
// hand.
struct JointMotion {
  JointKind kind = JointKind::kRotary;
  AxisLine line;

  Eigen::Isometry3d At(double position) const;
  // Of the line: direction (2), point (2) for rotary joints; direction (2) for linear ones.
  int ParameterCount() const { return kind == JointKind::kRotary ? 4 : 2; }
};

inline constexpr int kMostJoints = 12;

// The first joint is on the bed and carries the others.
Eigen::Isometry3d Carry(const JointMotion* joints, const double* positions, int count);
// At most kMostJoints of them. Change of Carry(...) * p per line parameter, joint by joint, written to 3 x (sum of ParameterCount).
void CarryParameterJacobian(const JointMotion* joints, const double* positions, int count, const Eigen::Vector3d& p,
                            Eigen::Ref<Eigen::Matrix3Xd> jacobian);
// Change of Carry(...) * p per position, 3 x count.
void CarryPositionJacobian(const JointMotion* joints, const double* positions, int count, const Eigen::Vector3d& p,
                           Eigen::Ref<Eigen::Matrix3Xd> jacobian);

struct Joint {
  std::string axis;    // the letter that programs and messages call it by
  JointMotion motion;  // the line at rest, as the record states it
  double sign = 1;     // +1 or -1: the sense of a positive command
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  std::optional<AngleTable> table = std::nullopt;  // rotary joints
};

// Thread-safe while it is not assigned to. Positions are commands in the order of joints(): part side from the bed
// outwards, then tool side likewise.
class JointChain {
 public:
  // INVALID_ARGUMENT naming the joint: no or repeated axis letter, direction not of length 1, not finite, a sign other
  // than +-1, limits out of order, a table on a linear joint.
  static absl::StatusOr<JointChain> Make(std::vector<Joint> part_side, std::vector<Joint> tool_side);

  const std::vector<Joint>& joints() const { return joints_; }
  // A joint's motion per command: its sign folded into the direction.
  const JointMotion& motion(int joint) const { return motions_.at(static_cast<size_t>(joint)); }
  int size() const { return static_cast<int>(joints_.size()); }
  int part_side_size() const { return part_size_; }
  // Index of an axis; nothing for one that the machine does not have.
  std::optional<int> Find(const std::string& axis) const;
  // Rotary joints on the part's side, from the bed outwards.
  std::vector<int> PartSideRotary() const;

  // OUT_OF_RANGE naming axis, value and limits in mm or degrees; INVALID_ARGUMENT for a wrong count or what is not finite.
  absl::Status CheckLimits(const Eigen::VectorXd& positions) const;
  // What the axes reach when they are commanded there, by their tables; joints without one reach their command. travel:
  // one for each joint, or empty where it is unknown.
  Eigen::VectorXd Reached(const Eigen::VectorXd& commanded, const std::vector<Travel>& travel) const;

  // Positions are taken as reached: no table is applied here.
  Eigen::Isometry3d MachineFromZero(const Eigen::VectorXd& positions) const;
  Eigen::Isometry3d MachineFromTool(const Eigen::VectorXd& positions) const;
  // A point fixed to the tool, where the part's own frame (at rest: the machine's) sees it.
  Eigen::Isometry3d ZeroFromTool(const Eigen::VectorXd& positions) const;

 private:
  // Signs folded into the directions, so that a command is a position.
  std::vector<JointMotion> motions_;
  std::vector<Joint> joints_;
  int part_size_ = 0;
};

}  // namespace sixpoint::metrology
