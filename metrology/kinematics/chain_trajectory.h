// Commands along a sequence of tool targets, without a jump of any joint (docs/methods/frames.md, inverse of a joint chain).
//
// Frames and units as in chain_solver.h. Pure and thread-safe; the same inputs give the same bits.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "metrology/kinematics/chain_solver.h"

namespace sixpoint::metrology {

// How far a joint may go from one target to the next, in mm or rad: always + per_mm * what the tip moves + per_rad * what the tool's axis
// turns, both seen in zero; a rotary joint a turn at most.
struct StepBound {
  double always = 0, per_mm = 0, per_rad = 0;
};

struct Continuity {
  StepBound rotary_rad, linear_mm;
  // Near the axis of the joint next to the part, where this tilt at most is left: that joint is led straight from where it comes to where it
  // goes, as it is along the axis itself.
  double allowed_tilt_rad = 0;
};

// One solution for each target. Of all ways through both branches and their whole turns, none of whose steps is longer than allowed, the one
// whose rotary joints travel least: from nominal to the first target, and on. Where the direction leaves a joint free, it goes evenly (by the
// allowed steps) from where it is determined before to where it is determined after; at either end it stands. Joints are compared as reached.
// INVALID_ARGUMENT: no target, or a malformed one, by its number. OUT_OF_RANGE, with field (`targets[7].C`), value and wanted: a target that
// ChainSolver refuses; or a jump: of the last targets that are reached without one, the least step that would go on.
// CANCELLED where keep_going (may be empty) says no.
absl::StatusOr<std::vector<ChainSolution>> SolveTrajectory(const ChainSolver& solver,
                                                           const std::vector<ToolTarget>& targets,
                                                           const Eigen::VectorXd& nominal_commanded,
                                                           const Continuity& continuity,
                                                           const std::function<bool()>& keep_going = {});

}  // namespace sixpoint::metrology
