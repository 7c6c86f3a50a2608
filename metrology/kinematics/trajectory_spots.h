// How a machine can stand at each target of a trajectory, before any of them is chosen (chain_trajectory.h).
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <vector>

#include "metrology/kinematics/chain_solver.h"
#include "metrology/kinematics/chain_trajectory.h"

namespace sixpoint::metrology {

// But for whole turns of the rotary joints.
struct SpotBranch {
  TurnAngles angles;
  Eigen::VectorXd reached;  // by all joints, at these angles
};

struct Spot {
  Eigen::Vector3d axis_in_zero = Eigen::Vector3d::UnitZ();
  bool free = false;                               // of its first joint every angle will do
  double tilt_rad = 0;                             // left where it is not free
  std::vector<SpotBranch> branches;                // within all limits; none where it is free
  double rotary_step_rad = 0, linear_step_mm = 0;  // allowed from the spot before
};

// The same refusal with the target's number before each field.
absl::Status AtTarget(size_t target, const absl::Status& refusal);

// As many as targets; refused as SolveTrajectory, but for jumps.
absl::StatusOr<std::vector<Spot>> SpotsOf(const ChainSolver& solver, const std::vector<ToolTarget>& targets,
                                          const Eigen::VectorXd& nominal_commanded, const Continuity& continuity);

}  // namespace sixpoint::metrology
