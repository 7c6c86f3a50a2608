// A shaped hole as a path of the tool, and the machine's commands along it on the blade as it really stands (docs/methods/correction.md,
// tool paths).
//
// Frames: part, zero, machine. Units: mm and radians. Pure and thread-safe; the same inputs give the same bits.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "metrology/correction/correct.h"
#include "metrology/kinematics/chain_solver.h"
#include "metrology/kinematics/chain_trajectory.h"

namespace sixpoint::metrology {

struct ToolPose {
  Eigen::Vector3d tip_in_part_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_in_part = Eigen::Vector3d::UnitZ();  // unit, from the tip to the holder: out of the part
};
struct NominalToolPath {
  std::string name;
  std::vector<ToolPose> poses;       // in the order of the cut
  RotaryAngles nominal;              // of the first pose, as commanded: of several ways to stand there the nearest
  double position_tolerance_mm = 0;  // of a tip, as a distance
  double inclination_tolerance_rad = 0;
};

// A pose for every 0.02 mm of 100 mm. More are not taken: each is solved some thirty times, and looked at by halves up to the next one.
inline constexpr std::size_t kMostToolPoses = 5000;
// INVALID_ARGUMENT, with "paths[NAME].poses", where it has none, or more.
absl::Status CheckPoseCount(const NominalToolPath& path);

struct CorrectedToolPose {
  // The tip at the commands, its covariance and budget; named by the pose's number, from 1. nominal_start_mm: of the nominal part, at
  // nominal_angles.
  CorrectedHole start;
  RotaryAngles corrected;  // commands, on the identified axes
  RotaryAngles reached;    // by those commands
  RotaryAngles
      nominal_angles;   // reached; of the nominal part on the identified axes, by the same way from pose to pose
  double tilt_rad = 0;  // left between the axis and machine Z
  bool b_is_free =
      false;  // the axis lies along B, or so near that B is led between its neighbours (chain_trajectory.h)
  double tilt_standard_uncertainty_rad = 0;  // these three as of CorrectedHoleGroup
  double a_standard_uncertainty_rad = 0;
  double b_standard_uncertainty_rad = 0;
};
struct CorrectedToolPath {
  std::string name;
  std::vector<CorrectedToolPose> poses;  // as many as the nominal ones
};

// How far an axis may go from pose to pose: by what it exceeds that, it jumps.
struct PathContinuity {
  StepBound rotary_rad, linear_mm;
};

// What stands between part and tool: both identified rotary axes with their limits and tables, and three linear axes that are true. The
// tool's tip is the origin of its frame, so that X, Y, Z are the tip in the machine. INVALID_ARGUMENT as ChainSolver::Make and JointChain::Make.
absl::StatusOr<ChainSolver> PathSolver(const RotaryAxes& axes, const RotaryPositioning& positioning,
                                       const RotaryLimits& limits,
                                       const std::array<std::string, 2>& letters = {"A", "B"});
// About the commands of a way that was found, so that no other one is as near.
RotaryLimits About(const std::vector<RotaryAngles>& commands);
// In the order of that chain's joints.
inline constexpr int kPathA = 0, kPathB = 1, kPathX = 2;

// Of a part as it stands, grown by warmth about the axis that carries it.
std::vector<ToolTarget> TargetsOf(const NominalToolPath& path, const Eigen::Isometry3d& zero_from_part,
                                  const Eigen::Affine3d& growth);

// Each pose carried rigidly by the registered pose, all solved at once (SolveTrajectory, with a quarter of the inclination tolerance to spare
// along B); warmth, tables, sources and what drilling adds enter as CorrectGroup has them. Covariances are those of the whole chain,
// the path solved anew for each parameter: where B is led, it is led there too.
// INVALID_ARGUMENT, with field, value and wanted: no name or pose, too many poses, an axis that is not unit, what is not finite. OUT_OF_RANGE, with
// fields "paths[NAME].targets[7].B" (poses from 0): beyond limits, by how much; a direction that is not reached, by which angle; a jump, of
// which joint and how long; "paths[NAME].nominal.targets[7].B" likewise of the nominal part, which limits bind where it can
// keep them: so it goes the same of several ways. CANCELLED where keep_going (may be empty) says no.
absl::StatusOr<CorrectedToolPath> CorrectToolPath(const NominalToolPath& path, const RegisteredPose& pose,
                                                  const Eigen::Isometry3d& zero_from_part_nominal,
                                                  const RotaryAxes& axes, const RotaryLimits& limits,
                                                  const PathContinuity& steps, const Drilling& drilling = {},
                                                  const std::array<std::string, 2>& letters = {"A", "B"},
                                                  const std::function<bool()>& keep_going = {});

}  // namespace sixpoint::metrology
