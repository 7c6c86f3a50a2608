#include "metrology/correction/path_draws.h"

#include <Eigen/Core>

#include "metrology/correction/start_uncertainty.h"

namespace sixpoint::metrology {
namespace {

// Of the way solved anew, at that pose.
DrawnAngles AnglesOfWay(const DrawnPath& path, std::size_t pose, const std::function<bool()>& keep_going) {
  std::vector<RotaryAngles> commands;
  for (const CorrectedToolPose& at : path.corrected.poses) commands.push_back(at.corrected);
  Eigen::VectorXd near = Eigen::VectorXd::Zero(kPathX + 3);
  near(kPathA) = commands.front().a_rad;
  near(kPathB) = commands.front().b_rad;
  // A draw turns the part by what it is uncertain: its steps are a little longer than those that were allowed.
  constexpr double kLonger = 2;
  const auto longer = [](StepBound bound) {
    return StepBound{kLonger * bound.always, kLonger * bound.per_mm, kLonger * bound.per_rad};
  };
  const Continuity continuity{longer(path.steps.rotary_rad), longer(path.steps.linear_mm),
                              AllowedTiltOf(path.nominal.inclination_tolerance_rad)};
  return [&path, &keep_going, pose, near, continuity, about = About(commands)](
             const Eigen::Isometry3d& zero_from_part, const RotaryAxes& axes) -> absl::StatusOr<RotaryAngles> {
    const auto solver = PathSolver(axes, path.pose.positioning, about, path.letters);
    if (!solver.ok()) return solver.status();
    const auto way =
        SolveTrajectory(*solver, TargetsOf(path.nominal, zero_from_part, axes.Growth(path.drilling.stretch)), near,
                        continuity, keep_going);
    if (!way.ok()) return way.status();
    const Eigen::VectorXd& reached = way->at(pose).reached;
    return RotaryAngles{reached(kPathA), reached(kPathB)};
  };
}

}  // namespace

NominalHoleGroup NominalPoseOf(const NominalToolPath& path, std::size_t pose) {
  NominalHoleGroup group;
  group.name = path.name;
  group.axis_in_part = path.poses[pose].axis_in_part;
  group.position_tolerance_mm = path.position_tolerance_mm;
  group.inclination_tolerance_rad = path.inclination_tolerance_rad;
  group.holes = {{std::to_string(pose + 1), path.poses[pose].tip_in_part_mm}};
  return group;
}

CorrectedHoleGroup CorrectedPoseOf(const std::string& path, const CorrectedToolPose& pose) {
  CorrectedHoleGroup group;
  group.name = path;
  group.corrected = pose.corrected;
  group.reached = pose.reached;
  group.nominal = pose.nominal_angles;
  group.tilt_rad = pose.tilt_rad;
  group.tilt_standard_uncertainty_rad = pose.tilt_standard_uncertainty_rad;
  group.a_standard_uncertainty_rad = pose.a_standard_uncertainty_rad;
  group.b_standard_uncertainty_rad = pose.b_standard_uncertainty_rad;
  group.holes = {pose.start};
  return group;
}

std::size_t PosesPerDraw(const CorrectedToolPath& path, std::size_t pose) {
  return path.poses[pose].b_is_free ? path.poses.size() : 1;
}

absl::StatusOr<DrawnStart> DrawPose(const DrawnPath& path, std::size_t pose, const DrawOptions& options) {
  const auto drawn =
      DrawStarts(NominalPoseOf(path.nominal, pose), CorrectedPoseOf(path.nominal.name, path.corrected.poses[pose]),
                 path.pose, path.axes, path.drilling, options,
                 path.corrected.poses[pose].b_is_free ? AnglesOfWay(path, pose, options.keep_going) : DrawnAngles{});
  if (!drawn.ok()) return drawn.status();
  return drawn->front();
}

}  // namespace sixpoint::metrology
