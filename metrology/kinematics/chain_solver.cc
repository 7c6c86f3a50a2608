#include "metrology/kinematics/chain_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/beyond_reach.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
constexpr double kLimitSlack_mm = 1e-9;  // rounding of a solved position
constexpr double kLeastVolume = 1e-6;    // of the box that three linear joints span

std::string Text(const Vector3d& v) {
  return "(" + Rounded(v.x()) + ", " + Rounded(v.y()) + ", " + Rounded(v.z()) + ")";
}

Vector3d Solved(const Eigen::Matrix3d& columns, double volume, const Vector3d& right) {
  const Vector3d x = columns.col(0), y = columns.col(1), z = columns.col(2);
  return Vector3d(right.dot(y.cross(z)), x.dot(right.cross(z)), x.dot(y.cross(right))) / volume;
}

// Beyond its limits, of all whole turns the least.
struct Excess {
  double command = 0, beyond = 0;
};
Excess ExcessOf(double command_rad, const Joint& joint) {
  const double above = command_rad + kTurn_rad * std::ceil((joint.maximum - command_rad) / kTurn_rad);
  const double below = command_rad + kTurn_rad * std::floor((joint.minimum - command_rad) / kTurn_rad);
  if (WithinLimits(command_rad, command_rad, joint.minimum, joint.maximum)) return {command_rad, 0};
  const Excess over{above, above - joint.maximum}, under{below, joint.minimum - below};
  return over.beyond <= under.beyond ? over : under;
}

Violation LimitViolation(const Joint& joint, double command, double beyond) {
  const bool rotary = joint.motion.kind == JointKind::kRotary;
  const double unit = rotary ? kDegPerRad : 1;
  const std::string name = rotary ? " deg" : " mm";
  return {joint.axis, Rounded(command * unit) + name + ", " + Rounded(beyond * unit) + name + " beyond",
          Rounded(joint.minimum * unit) + " to " + Rounded(joint.maximum * unit) + name};
}

}  // namespace

absl::StatusOr<ChainSolver> ChainSolver::Make(const JointChain& chain, const ChainSolverOptions& options) {
  ChainSolver solver(chain);
  solver.tool_ = options.tool;
  solver.travel_ = options.travel;
  const MountedTool& tool = options.tool;
  if (!(std::abs(tool.axis_in_tool.norm() - 1) <= 1e-6))
    return Refuse("tool.axis_in_tool", Text(tool.axis_in_tool), "a unit direction");
  if (!tool.gauge_in_tool_mm.allFinite() || !std::isfinite(tool.length_mm))
    return Refuse("tool.gauge_in_tool_mm, length_mm", "not finite", "a point and a length");
  if (!options.travel.empty() && static_cast<int>(options.travel.size()) != chain.size())
    return Refuse("travel", std::to_string(options.travel.size()) + " values",
                  std::to_string(chain.size()) + ", one for each joint, or none");
  solver.tool_.axis_in_tool.normalize();
  if (absl::Status status = solver.SortJoints(options); !status.ok()) return status;
  if (absl::Status status = solver.CheckDirections(); !status.ok()) return status;
  return solver;
}

std::string ChainSolver::Named(const std::vector<int>& joints) const {
  std::string names;
  for (const int joint : joints)
    names += (names.empty() ? "" : ", ") + chain_.joints()[static_cast<size_t>(joint)].axis;
  return names.empty() ? "none" : names;
}

absl::Status ChainSolver::SortJoints(const ChainSolverOptions& options) {
  for (const std::string& axis : options.held) {
    const std::optional<int> joint = chain_.Find(axis);
    if (!joint || chain_.motion(*joint).kind != JointKind::kLinear)
      return Refuse("held", axis, "a linear joint of the machine");
    if (std::find(held_.begin(), held_.end(), *joint) != held_.end()) return Refuse("held", axis, "each joint once");
    held_.push_back(*joint);
  }
  std::vector<int> rotary, linear;
  // From the part to the bed, and from there to the tool.
  for (int i = chain_.part_side_size() - 1; i >= 0; --i)
    if (chain_.motion(i).kind == JointKind::kRotary) rotary.push_back(i);
  for (int i = 0; i < chain_.size(); ++i) {
    const bool turns = chain_.motion(i).kind == JointKind::kRotary;
    if (turns && i >= chain_.part_side_size()) rotary.push_back(i);
    if (!turns && std::find(held_.begin(), held_.end(), i) == held_.end()) linear.push_back(i);
  }
  Refusals refusals;
  if (rotary.size() != 2)
    refusals.Add(Refuse("kinematics.rotary", std::to_string(rotary.size()) + " joints: " + Named(rotary), "two"));
  if (linear.size() != 3)
    refusals.Add(Refuse("kinematics.linear", std::to_string(linear.size()) + " joints: " + Named(linear),
                        "three beside those held (" + Named(held_) + ")"));
  if (!refusals.status().ok()) return refusals.status();
  std::copy(rotary.begin(), rotary.end(), rotary_.begin());
  std::copy(linear.begin(), linear.end(), linear_.begin());
  column_.fill(-1);
  for (size_t k = 0; k < linear_.size(); ++k) column_[static_cast<size_t>(linear_[k])] = static_cast<int>(k);

  // A joint of the part's side turns the part away under the tool.
  const auto direction = [&](int joint) {
    const Vector3d d = chain_.motion(joint).line.direction.normalized();
    return joint < chain_.part_side_size() ? Vector3d(-d) : d;
  };
  turns_ = {direction(rotary_[0]), direction(rotary_[1])};
  const Joint &first = chain_.joints()[static_cast<size_t>(rotary_[0])],
              &second = chain_.joints()[static_cast<size_t>(rotary_[1])];
  limits_ = {Reached(rotary_[0], first.minimum), Reached(rotary_[0], first.maximum),
             Reached(rotary_[1], second.minimum), Reached(rotary_[1], second.maximum)};
  return absl::OkStatus();
}

absl::Status ChainSolver::CheckDirections() const {
  const std::vector<int> rotary(rotary_.begin(), rotary_.end()), linear(linear_.begin(), linear_.end());
  Refusals refusals;
  if (turns_.Parallel())
    refusals.Add(Refuse("kinematics.rotary", Named(rotary) + ": parallel", "two joints of different directions"));
  if (turns_.second.cross(tool_.axis_in_tool).norm() < kSingularAngle_rad)
    refusals.Add(Refuse("tool.axis_in_tool", Text(tool_.axis_in_tool) + ", along " + Named({rotary_[1]}),
                        "a direction that " + Named({rotary_[1]}) + " turns"));
  // A chain may be dependent where it rests and nowhere else, or there alone independent.
  double greatest = 0;
  for (const auto& [first_rad, second_rad] : {std::pair(0.0, 0.0), {0.7, 1.1}}) {
    Eigen::VectorXd reached = Eigen::VectorXd::Zero(chain_.size());
    reached(rotary_[0]) = first_rad;
    reached(rotary_[1]) = second_rad;
    Eigen::Matrix3d directions;
    Walk(0, chain_.part_side_size(), reached, 1, &directions);
    Walk(chain_.part_side_size(), chain_.size(), reached, -1, &directions);
    greatest = std::fmax(greatest, std::abs(directions.col(0).dot(directions.col(1).cross(directions.col(2)))));
  }
  if (!(greatest >= kLeastVolume))
    refusals.Add(Refuse("kinematics.linear", Named(linear) + ": dependent", "three independent directions"));
  return refusals.status();
}

double ChainSolver::CommandFor(int joint, double reached_rad) const {
  const auto& table = chain_.joints()[static_cast<size_t>(joint)].table;
  return table ? table->CommandFor(reached_rad, TravelOf(joint)) : reached_rad;
}

double ChainSolver::Reached(int joint, double commanded_rad) const {
  const auto& table = chain_.joints()[static_cast<size_t>(joint)].table;
  return table && std::isfinite(commanded_rad) ? table->Reached(commanded_rad, TravelOf(joint)) : commanded_rad;
}

TurnAngles ChainSolver::ReachedTurns(const Eigen::VectorXd& commanded) const {
  return {Reached(rotary_[0], commanded(rotary_[0])), Reached(rotary_[1], commanded(rotary_[1]))};
}

Eigen::VectorXd ChainSolver::Commanded(const Eigen::VectorXd& reached) const {
  Eigen::VectorXd commanded = reached;
  for (const int joint : rotary_) {
    const Joint& limits = chain_.joints()[static_cast<size_t>(joint)];
    if (!limits.table) continue;
    commanded(joint) = CommandFor(joint, reached(joint));
    // What a table leaves beyond a limit by rounding is within it.
    constexpr double kRounding_rad = 1e-11;
    const double within = std::fmin(std::fmax(commanded(joint), limits.minimum), limits.maximum);
    if (std::abs(commanded(joint) - within) <= kRounding_rad) commanded(joint) = within;
  }
  return commanded;
}

ChainSolver::Side ChainSolver::Walk(int begin, int end, const Eigen::VectorXd& reached, double sense,
                                    Eigen::Matrix3d* directions) const {
  Side side;
  for (int i = begin; i < end; ++i) {
    const JointMotion& motion = chain_.motion(i);
    if (motion.kind == JointKind::kRotary) {
      const Eigen::Isometry3d turn = motion.At(reached(i));
      side.shift_mm += side.turn * turn.translation();
      side.turn = side.turn * turn.linear();
    } else if (const int column = column_[static_cast<size_t>(i)]; column >= 0) {
      directions->col(column) = sense * (side.turn * motion.line.direction);
    } else {
      side.shift_mm += side.turn * (reached(i) * motion.line.direction);
    }
  }
  return side;
}

// part side: m = P p + sum q c, tool side: m = T tip + sum q c; the m is one.
absl::StatusOr<Eigen::VectorXd> ChainSolver::Place(const Vector3d& tip_in_zero_mm, const TurnAngles& turns,
                                                   const Eigen::VectorXd& nominal_commanded) const {
  Eigen::VectorXd reached = nominal_commanded;
  reached(rotary_[0]) = turns.first_rad;
  reached(rotary_[1]) = turns.second_rad;
  Eigen::Matrix3d directions;
  const Side part = Walk(0, chain_.part_side_size(), reached, 1, &directions);
  const Side tool = Walk(chain_.part_side_size(), chain_.size(), reached, -1, &directions);
  const double volume = directions.col(0).dot(directions.col(1).cross(directions.col(2)));
  if (!(std::abs(volume) >= kLeastVolume))
    return BeyondReach(
        {{Named({linear_.begin(), linear_.end()}),
          "dependent at " + Named({rotary_.begin(), rotary_.end()}) + " " + Rounded(turns.first_rad * kDegPerRad) +
              ", " + Rounded(turns.second_rad * kDegPerRad) + " deg",
          "three independent directions"}});
  const Vector3d gap_mm =
      tool.turn * tool_.TipInToolMm() + tool.shift_mm - (part.turn * tip_in_zero_mm + part.shift_mm);
  Vector3d q = Solved(directions, volume, gap_mm);
  q += Solved(directions, volume, gap_mm - directions * q);  // what rounding left where they are nearly dependent
  std::vector<Violation> beyond;
  for (size_t k = 0; k < linear_.size(); ++k) {
    const Joint& joint = chain_.joints()[static_cast<size_t>(linear_[k])];
    const double at = q(static_cast<Eigen::Index>(k)), within = std::fmin(std::fmax(at, joint.minimum), joint.maximum);
    if (std::abs(at - within) > kLimitSlack_mm) beyond.push_back(LimitViolation(joint, at, std::abs(at - within)));
    reached(linear_[k]) = within;
  }
  if (!beyond.empty()) return BeyondReach(beyond);
  return reached;
}

absl::Status ChainSolver::Check(const ToolTarget& target, const Eigen::VectorXd& nominal, double allowed_tilt) const {
  if (!(std::abs(target.axis_in_zero.norm() - 1) < 1e-6))
    return Refuse("axis_in_zero", Text(target.axis_in_zero), "a unit direction");
  if (!target.tip_in_zero_mm.allFinite()) return Refuse("tip_in_zero_mm", Text(target.tip_in_zero_mm), "a point");
  if (nominal.size() != chain_.size())
    return Refuse("nominal_commanded", std::to_string(nominal.size()) + " values",
                  std::to_string(chain_.size()) + ", one for each joint");
  if (!nominal.allFinite()) return Refuse("nominal_commanded", "not finite", "positions");
  for (const int joint : held_) {
    const Joint& held = chain_.joints()[static_cast<size_t>(joint)];
    const double within = std::fmin(std::fmax(nominal(joint), held.minimum), held.maximum);
    if (std::abs(nominal(joint) - within) > kLimitSlack_mm)
      return BeyondReach({LimitViolation(held, nominal(joint), std::abs(nominal(joint) - within))});
  }
  if (!(allowed_tilt >= 0)) return Refuse("allowed_tilt_rad", Rounded(allowed_tilt), "0 or more");
  return absl::OkStatus();
}

absl::Status ChainSolver::Refusal(const ToolTarget& target, const TurnChoices& found, double allowed_tilt_rad) const {
  const TurnBranches& branches = found.branches;
  const std::string names = Named({rotary_.begin(), rotary_.end()});
  if (branches.miss_rad > allowed_tilt_rad)
    return BeyondReach({{"axis_in_zero",
                         Text(target.axis_in_zero) + ", " + Rounded(branches.miss_rad * kDegPerRad) +
                             " deg from the nearest within reach",
                         "a direction that " + names + " bring the tool along (unreachable)"}});
  std::vector<Violation> least;
  double least_beyond = std::numeric_limits<double>::infinity();
  for (int k = 0; k < branches.count; ++k) {
    const TurnAngles& angles = branches.angles[static_cast<size_t>(k)];
    std::vector<Violation> beyond;
    double sum = 0;
    for (const auto& [joint, angle_rad] : {std::pair(rotary_[0], angles.first_rad), {rotary_[1], angles.second_rad}}) {
      const Joint& limits = chain_.joints()[static_cast<size_t>(joint)];
      const Excess excess = ExcessOf(CommandFor(joint, angle_rad), limits);
      if (excess.beyond > 0) beyond.push_back(LimitViolation(limits, excess.command, excess.beyond));
      sum += excess.beyond;
    }
    if (sum < least_beyond && !beyond.empty()) {
      least = beyond;
      least_beyond = sum;
    }
  }
  // By rounding in a table a limit may be met there and not here.
  return least.empty() ? BeyondReach({{names, "at a limit", "within the limits"}}) : BeyondReach(least);
}

absl::StatusOr<ChainSolution> ChainSolver::Solve(const ToolTarget& target, const Eigen::VectorXd& nominal_commanded,
                                                 double allowed_tilt_rad) const {
  if (absl::Status status = Check(target, nominal_commanded, allowed_tilt_rad); !status.ok()) return status;
  const TurnChoices found = NearestTurns(turns_, tool_.axis_in_tool, target.axis_in_zero.normalized(),
                                         ReachedTurns(nominal_commanded), limits_, allowed_tilt_rad);
  absl::Status refusal;
  for (int k = 0; k < found.count; ++k) {
    const TurnChoice& choice = found.choices[static_cast<size_t>(k)];
    auto reached = Place(target.tip_in_zero_mm, choice.angles, nominal_commanded);
    if (!reached.ok()) {
      refusal.Update(reached.status());
      continue;
    }
    ChainSolution solution;
    solution.commanded = Commanded(*reached);
    solution.reached = *std::move(reached);
    solution.tilt_rad = choice.tilt_rad;
    if (choice.loose != WhichTurn::kNone) solution.loose_joint = rotary_[choice.loose == WhichTurn::kFirst ? 0 : 1];
    return solution;
  }
  return refusal.ok() ? Refusal(target, found, allowed_tilt_rad) : refusal;
}

}  // namespace sixpoint::metrology
