#include "metrology/correction/tool_path.h"

#include <cmath>
#include <limits>
#include <utility>

#include "metrology/correction/start_uncertainty.h"
#include "metrology/kinematics/beyond_reach.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
const RotaryLimits kUnlimited{-kInfinite, kInfinite, -kInfinite, kInfinite};
constexpr Eigen::Index kPerPose = kBeforeStarts + 3;  // values of the chain

absl::Status Check(const NominalToolPath& path) {
  Refusals refusals;
  if (path.name.empty()) refusals.Add(Refuse("paths.name", "", "a name"));
  const std::string prefix = "paths[" + path.name + "].";
  if (absl::Status count = CheckPoseCount(path); !count.ok()) {
    refusals.Add(count);
    return refusals.status();
  }
  for (std::size_t i = 0; i < path.poses.size(); ++i) {
    const std::string pose = prefix + "poses[" + std::to_string(i) + "].";
    const double length = path.poses[i].axis_in_part.norm();
    if (!(std::abs(length - 1) < 1e-6))
      refusals.Add(Refuse(pose + "axis_in_part", "of length " + Rounded(length), "a unit direction"));
    if (!path.poses[i].tip_in_part_mm.allFinite())
      refusals.Add(Refuse(pose + "tip_in_part_mm", "not finite", "a point"));
  }
  for (const auto& [field, value] : {std::pair("position_tolerance_mm", path.position_tolerance_mm),
                                     {"inclination_tolerance_rad", path.inclination_tolerance_rad}})
    if (!(value >= 0 && std::isfinite(value))) refusals.Add(Refuse(prefix + field, value, "0 or more"));
  if (!std::isfinite(path.nominal.a_rad) || !std::isfinite(path.nominal.b_rad))
    refusals.Add(Refuse(prefix + "nominal", "not finite", "angles"));
  return refusals.status();
}

Eigen::VectorXd Commands(double a_rad, double b_rad) {
  Eigen::VectorXd commands = Eigen::VectorXd::Zero(kPathX + 3);
  commands(kPathA) = a_rad;
  commands(kPathB) = b_rad;
  return commands;
}

// The path with everything that decides its commands.
struct PathChain {
  const NominalToolPath& path;
  const RegisteredPose& pose;
  const RotaryAxes& axes;
  Eigen::Affine3d growth;
  PathContinuity steps;
  std::array<std::string, 2> letters;
  const std::function<bool()>& keep_going;

  // share: of the steps that are allowed.
  absl::StatusOr<std::vector<ChainSolution>> Solve(const Eigen::Isometry3d& zero_from_part, const RotaryAxes& moved,
                                                   const RotaryAngles& near, const RotaryLimits& limits,
                                                   double share) const {
    const absl::StatusOr<ChainSolver> solver = PathSolver(moved, pose.positioning, limits, letters);
    if (!solver.ok()) return solver.status();
    const auto grown = [share](StepBound bound) {
      return StepBound{share * bound.always, share * bound.per_mm, share * bound.per_rad};
    };
    return SolveTrajectory(
        *solver, TargetsOf(path, zero_from_part, growth), Commands(near.a_rad, near.b_rad),
        {grown(steps.rotary_rad), grown(steps.linear_mm), AllowedTiltOf(path.inclination_tolerance_rad)}, keep_going);
  }

  // Of every pose: a, b, x and y of the turned direction, x, y, z of the start. Neither limits nor steps bind here: the way is the one
  // found, from its first commands on, and `around` it.
  absl::StatusOr<Eigen::VectorXd> Values(const ChainParameters& change, const RotaryAngles& near,
                                         const RotaryLimits& around) const {
    const auto [zero_from_part, moved] = Moved(pose, axes, change);
    constexpr double kWider = 1.01;
    const auto solved = Solve(zero_from_part, moved, near, around, kWider);
    if (!solved.ok()) return solved.status();
    Eigen::VectorXd values(kPerPose * static_cast<Eigen::Index>(solved->size()));
    for (std::size_t i = 0; i < solved->size(); ++i) {
      const Eigen::VectorXd& reached = solved->at(i).reached;
      const Eigen::Vector3d direction = zero_from_part.linear() * path.poses[i].axis_in_part;
      auto of_pose = values.segment<kPerPose>(kPerPose * static_cast<Eigen::Index>(i));
      of_pose.head<2>() = reached.segment<2>(kPathA);
      of_pose.segment<2>(2) = (moved.MachineFromZero(reached(kPathA), reached(kPathB)).linear() * direction).head<2>();
      of_pose.tail<3>() = reached.segment<3>(kPathX);
    }
    return values;
  }
};

// What was solved again, and differentiated, is the way that was found: a change of a millionth that turns an axis by degrees is another
// one, and what is uncertain of the angles is then not known.
absl::Status CheckSameWay(const std::vector<ChainSolution>& solved, const Eigen::VectorXd& values,
                          const Eigen::MatrixXd& jacobian) {
  constexpr double kGreatestTurn = 1e5;  // rad per rad, or per mm; beyond 1e3 a direction is singular (two_turns.h)
  for (std::size_t i = 0; i < solved.size(); ++i) {
    const Eigen::Index row = kPerPose * static_cast<Eigen::Index>(i);
    const double greatest = jacobian.middleRows<2>(row).cwiseAbs().maxCoeff();
    const double apart_rad = (solved[i].reached.segment<2>(kPathA) - values.segment<2>(row)).norm();
    if (greatest < kGreatestTurn && apart_rad < 1e-9) continue;
    return BeyondReach({{"targets[" + std::to_string(i) + "].axis_in_zero",
                         "turns a rotary axis by " + Rounded(greatest) + " rad per rad of the pose",
                         "a way on which an uncertain pose has an uncertainty of the angles"}});
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckPoseCount(const NominalToolPath& path) {
  const std::string field = "paths[" + path.name + "].poses";
  if (path.poses.empty()) return Refuse(field, "none", "one at least");
  if (path.poses.size() > kMostToolPoses)
    return Refuse(field, std::to_string(path.poses.size()), "at most " + std::to_string(kMostToolPoses));
  return absl::OkStatus();
}

absl::StatusOr<ChainSolver> PathSolver(const RotaryAxes& axes, const RotaryPositioning& positioning,
                                       const RotaryLimits& limits, const std::array<std::string, 2>& letters) {
  const auto rotary = [](const std::string& letter, const AxisLine& line, double minimum, double maximum,
                         const AxisPositioning& of) {
    AxisLine unit = line;
    unit.direction.normalize();
    return Joint{letter, {JointKind::kRotary, unit}, 1, minimum, maximum, of.table};
  };
  std::vector<Joint> part_side = {
      rotary(letters[0], axes.a, limits.a_minimum_rad, limits.a_maximum_rad, positioning.a),
      rotary(letters[1], axes.b, limits.b_minimum_rad, limits.b_maximum_rad, positioning.b)};
  std::vector<Joint> tool_side;
  for (const auto& [letter, direction] :
       {std::pair("X", Eigen::Vector3d(1, 0, 0)), {"Y", Eigen::Vector3d(0, 1, 0)}, {"Z", Eigen::Vector3d(0, 0, 1)}})
    tool_side.push_back({letter, {JointKind::kLinear, {direction, Eigen::Vector3d::Zero()}}});
  const auto chain = JointChain::Make(std::move(part_side), std::move(tool_side));
  if (!chain.ok()) return chain.status();
  ChainSolverOptions options;
  options.travel = {positioning.a.approach, positioning.b.approach, Travel::kUnknown, Travel::kUnknown,
                    Travel::kUnknown};
  return ChainSolver::Make(*chain, options);
}

RotaryLimits About(const std::vector<RotaryAngles>& commands) {
  constexpr double kMargin_rad = 0.1;
  RotaryLimits around{kInfinite, -kInfinite, kInfinite, -kInfinite};
  for (const RotaryAngles& at : commands) {
    around.a_minimum_rad = std::fmin(around.a_minimum_rad, at.a_rad - kMargin_rad);
    around.a_maximum_rad = std::fmax(around.a_maximum_rad, at.a_rad + kMargin_rad);
    around.b_minimum_rad = std::fmin(around.b_minimum_rad, at.b_rad - kMargin_rad);
    around.b_maximum_rad = std::fmax(around.b_maximum_rad, at.b_rad + kMargin_rad);
  }
  return around;
}

std::vector<ToolTarget> TargetsOf(const NominalToolPath& path, const Eigen::Isometry3d& zero_from_part,
                                  const Eigen::Affine3d& growth) {
  std::vector<ToolTarget> targets;
  targets.reserve(path.poses.size());
  for (const ToolPose& pose : path.poses)
    targets.push_back({growth * (zero_from_part * pose.tip_in_part_mm), zero_from_part.linear() * pose.axis_in_part});
  return targets;
}

absl::StatusOr<CorrectedToolPath> CorrectToolPath(const NominalToolPath& path, const RegisteredPose& pose,
                                                  const Eigen::Isometry3d& zero_from_part_nominal,
                                                  const RotaryAxes& axes, const RotaryLimits& limits,
                                                  const PathContinuity& steps, const Drilling& drilling,
                                                  const std::array<std::string, 2>& letters,
                                                  const std::function<bool()>& keep_going) {
  if (absl::Status status = Check(path); !status.ok()) return status;
  if (absl::Status status = CheckFinite(pose); !status.ok()) return status;
  const std::string prefix = "paths[" + path.name + "].";
  const PathChain chain{path, pose, axes, axes.Growth(drilling.stretch), steps, letters, keep_going};
  const auto solved = chain.Solve(pose.zero_from_part, axes, path.nominal, limits, 1);
  if (!solved.ok()) return UnderField(prefix, solved.status());
  // Of several ways the nominal part takes the same as the real one: that which its machine can go. Where it can go none, limits do not bind what
  // is not cut.
  auto nominal = chain.Solve(zero_from_part_nominal, axes, path.nominal, limits, 1);
  if (!nominal.ok()) nominal = chain.Solve(zero_from_part_nominal, axes, path.nominal, kUnlimited, 1);
  if (!nominal.ok()) return UnderField(prefix + "nominal.", nominal.status());

  std::vector<RotaryAngles> commands;
  for (const ChainSolution& at : *solved) commands.push_back({at.commanded(kPathA), at.commanded(kPathB)});
  const RotaryLimits around = About(commands);
  const auto values_at = [&](const ChainParameters& change) { return chain.Values(change, commands.front(), around); };
  const auto values = values_at(ChainParameters::Zero());
  if (!values.ok()) return UnderField(prefix, values.status());
  const auto jacobian = ChainJacobian(values->size(), values_at);
  if (!jacobian.ok()) return UnderField(prefix, jacobian.status());
  if (absl::Status status = CheckSameWay(*solved, *values, *jacobian); !status.ok()) return UnderField(prefix, status);

  CorrectedToolPath result{path.name, {}};
  for (std::size_t i = 0; i < path.poses.size(); ++i) {
    const ChainSolution &at = solved->at(i), &nominal_at = nominal->at(i);
    CorrectedToolPose& corrected = result.poses.emplace_back();
    corrected.start.name = std::to_string(i + 1);
    corrected.start.start_mm = at.reached.segment<3>(kPathX);
    corrected.start.nominal_start_mm = nominal_at.reached.segment<3>(kPathX);
    corrected.corrected = commands[i];
    corrected.reached = {at.reached(kPathA), at.reached(kPathB)};
    corrected.nominal_angles = {nominal_at.reached(kPathA), nominal_at.reached(kPathB)};
    corrected.tilt_rad = at.tilt_rad;
    corrected.b_is_free = at.loose_joint.has_value();
    const Eigen::Index row = kPerPose * static_cast<Eigen::Index>(i);
    const std::vector<UncertaintyPart> parts =
        PartsOf(jacobian->middleRows(row, kPerPose), values->segment(row, kPerPose), pose);
    const AngleUncertainty angles = AngleUncertaintyOf(parts, pose.positioning, corrected.corrected);
    corrected.a_standard_uncertainty_rad = angles.a_rad;
    corrected.b_standard_uncertainty_rad = angles.b_rad;
    corrected.tilt_standard_uncertainty_rad = angles.tilt_rad;
    const Eigen::Matrix<double, 3, 2> moved_per_angle = axes.AngleJacobian(
        pose.zero_from_part * path.poses[i].tip_in_part_mm, corrected.reached.a_rad, corrected.reached.b_rad);
    SumUpStart(parts, kBeforeStarts, drilling, pose.positioning, moved_per_angle, angles.turn_variance_rad2,
               &corrected.start);
  }
  return result;
}

}  // namespace sixpoint::metrology
