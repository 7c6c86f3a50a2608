#include "metrology/correction/nc_proof.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "metrology/frames/angles.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kSame_mm = 1e-3 * kGreatestNcDifference_um;

struct Difference {
  double um = 0, tilt_deg = 0;
  double turn_deg = 0;  // of a path's pose: the greater one of A and B from those commanded
  bool Small() const { return um <= kGreatestNcDifference_um && std::fmax(tilt_deg, turn_deg) <= kGreatestNcTilt_deg; }
};

absl::Status RefuseMove(const NcMove& move, const std::string& found, const std::string& wanted) {
  return Refuse("nc_template", "line " + std::to_string(move.line) + ": " + found, wanted);
}

bool Known(const NcPosition& at) {
  return std::all_of(at.begin(), at.end(), [](const auto& axis) { return axis.has_value(); });
}

class Proof {
 public:
  Proof(const std::map<std::string, NcTarget>& targets, const RotaryAxes& axes)
      : targets_(targets), axes_(axes), paths_(PathsOf(targets)) {}

  absl::Status Follow(const NcMove& move) {
    if (absl::Status status = Judge(move); !status.ok()) return status;
    if (!OnlyZ(move) || !move.from[kNcZ].has_value()) above_mm_ = move.to[kNcZ];
    if (move.to[kNcZ].has_value()) above_mm_ = std::max(*move.to[kNcZ], above_mm_.value_or(*move.to[kNcZ]));
    return absl::OkStatus();
  }

  absl::Status End() const {
    if (!path_pose_.empty())
      return Refuse(
          "nc_template", "it ends at " + path_pose_,
          LastOfPath() ? "Z raised from it, as high as the path was entered from" : "a feed (G1) to " + NextOfPath());
    if (absl::Status left = Leave(); !left.ok()) return left;
    for (const auto& [name, target] : targets_)
      if (reached_.count(name) == 0)
        return Refuse("nc_template", name + " is not in it", "every hole of the correction");
    return absl::OkStatus();
  }

  NcProof proof;

 private:
  absl::Status Judge(const NcMove& move) {
    if (move.path_tolerance_mm > kSame_mm)
      return RefuseMove(move, "a path tolerance (G64 P)", "exact moves: G61, or G64 without P");
    if (move.switches_on) return Shot(move);
    if (move.arc) return RefuseMove(move, "an arc (G2, G3)", "straight moves (G0, G1)");
    if (!path_pose_.empty()) return AlongPath(move);
    if (move.by_direction)
      return RefuseMove(move, "a direction (A3, B3, C3) outside a path",
                        "its axes' values; directions from pose to pose");
    if (!OnlyZ(move) && InHole(move.from))
      return RefuseMove(move, "sideways out of " + last_reached_, "Z raised first");
    if (!move.target.empty()) return Marked(move);
    follows_ = follows_ && OnlyZ(move) && move.by_steps;
    if (move.feed) return UnmarkedFeed(move);
    return UnmarkedRapid(move);
  }

  // Where the axes hold which point of the part under the tool, and in what direction. Axes seldom turn between two looks.
  const Eigen::Isometry3d& ZeroFromMachine(double a_deg, double b_deg) {
    if (a_deg != a_deg_ || b_deg != b_deg_)
      zero_from_machine_ =
          axes_.MachineFromZero((a_deg_ = a_deg) * kRadPerDeg, (b_deg_ = b_deg) * kRadPerDeg).inverse();
    return zero_from_machine_;
  }

  struct Pose {
    Eigen::Vector3d start_mm, direction;  // on the part
  };
  Pose PoseAt(const Eigen::Vector3d& point_mm, double a_deg, double b_deg) {
    const Eigen::Isometry3d& zero_from_machine = ZeroFromMachine(a_deg, b_deg);
    return {zero_from_machine * point_mm, zero_from_machine.linear().col(2)};
  }

  // Of that position from the target's, with Z as it is or as the target's.
  Difference From(const NcPosition& at, const std::string& name, bool with_z) {
    const NcTarget& target = targets_.at(name);
    auto known = poses_.find(name);
    if (known == poses_.end())
      known = poses_.emplace(name, PoseAt({target.x_mm, target.y_mm, target.z_mm}, target.a_deg, target.b_deg)).first;
    const Pose& wanted = known->second;
    const Pose found = PoseAt({*at[0], *at[1], with_z ? *at[kNcZ] : target.z_mm}, *at[3], *at[4]);
    Difference difference{
        1e3 * (found.start_mm - wanted.start_mm).norm(),
        std::atan2(found.direction.cross(wanted.direction).norm(), found.direction.dot(wanted.direction)) / kRadPerDeg};
    // The same pose a whole turn away would be a cut of a whole turn to the next one.
    if (target.number > 0)
      difference.turn_deg = std::fmax(std::abs(*at[3] - target.a_deg), std::abs(*at[4] - target.b_deg));
    return difference;
  }

  absl::Status Marked(const NcMove& move) {
    const auto found = targets_.find(move.target);
    if (found == targets_.end()) return RefuseMove(move, move.target, "a hole of the correction");
    if (open_ != move.target) {
      if (absl::Status left = Leave(); !left.ok()) return left;
      open_ = move.target;
      reached_now_ = false;
    }
    const NcTarget& target = found->second;
    if (target.number > 0)
      if (absl::Status begins = CheckBegin(move, target); !begins.ok()) return begins;
    if (Known(move.to)) {
      const Difference difference = From(move.to, move.target, true);
      if (difference.Small()) return target.number > 0 ? EnterPath(move, difference) : Reach(move.target, difference);
    }
    follows_ = false;
    // On its way: from above, and not yet down.
    const bool above = move.from[kNcZ].has_value() && move.to[kNcZ].has_value() && *move.from[kNcZ] > target.z_mm &&
                       *move.to[kNcZ] > target.z_mm + kSame_mm;
    if (move.feed && !above) return RefuseMove(move, "cuts away from " + move.target, WantedPose());
    return absl::OkStatus();
  }

  // A path is entered by its first pose, and once.
  absl::Status CheckBegin(const NcMove& move, const NcTarget& target) const {
    if (target.number > 1)
      return RefuseMove(move, move.target + " without a feed from the pose before it",
                        "the path's poses in their order, from " + target.path + "/1");
    if (reached_.count(move.target) > 0)
      return RefuseMove(move, move.target + " for the second time", "each pose of a path once");
    return absl::OkStatus();
  }

  absl::Status EnterPath(const NcMove& move, const Difference& difference) {
    if (!Known(move.from) || !OnlyZ(move) || !(*move.from[kNcZ] > *move.to[kNcZ]))
      return RefuseMove(move, move.target + " is not reached from above", "Z alone, down to the path's first pose");
    path_pose_ = move.target;
    entered_from_mm_ = std::max(*move.from[kNcZ], above_mm_.value_or(*move.from[kNcZ]));
    entered_down_mm_ = entered_from_mm_ - *move.to[kNcZ];
    return Reach(move.target, difference, false);
  }

  bool LastOfPath() const {
    const NcTarget& at = targets_.at(path_pose_);
    return at.number == paths_.at(at.path);
  }
  std::string NextOfPath() const {
    const NcTarget& at = targets_.at(path_pose_);
    return at.path + "/" + std::to_string(at.number + 1);
  }

  // From a pose of a path: on to the next one, all five axes by feed; from the last one upwards.
  absl::Status AlongPath(const NcMove& move) {
    if (LastOfPath()) return LeavePath(move);
    const std::string next = NextOfPath();
    if (move.target != next)
      return RefuseMove(move, "from " + path_pose_ + (move.target.empty() ? " without a marker" : " to " + move.target),
                        "a feed (G1) to " + next + ", marked");
    if (!move.motion_said)
      return RefuseMove(move, "no G1 said before, from " + path_pose_ + " to " + next, "a feed (G1)");
    if (!move.feed) return RefuseMove(move, "a rapid (G0) from " + path_pose_ + " to " + next, "a feed (G1)");
    if (!Known(move.from))  // another tool
      return RefuseMove(move, "not all axes are known at " + path_pose_, "the same tool from pose to pose");
    if (!Known(move.to)) return RefuseMove(move, "not all axes are known at " + next, WantedPose());
    const Difference difference = From(move.to, next, true);
    if (!difference.Small()) return RefuseMove(move, "cuts away from " + next, WantedPose());
    path_pose_ = open_ = next;
    return Reach(next, difference, false);
  }

  // Clear of the part is only what is as high as the tool came from; it may go there in several blocks.
  absl::Status LeavePath(const NcMove& move) {
    if (move.by_direction)
      return RefuseMove(move, "a direction (A3, B3, C3) from " + path_pose_, "TRAFOOF, and Z raised");
    const double last_mm = targets_.at(path_pose_).z_mm;
    const double clear_mm = entered_from_mm_ > last_mm + kSame_mm ? entered_from_mm_ : last_mm + entered_down_mm_;
    const bool up = move.target.empty() && OnlyZ(move) && Known(move.from) && Known(move.to) &&
                    *move.to[kNcZ] > *move.from[kNcZ] + kSame_mm;
    if (!up)
      return RefuseMove(move, "not upwards from " + path_pose_,
                        "Z raised first, to " + Rounded(clear_mm) + " at least, in a block without a marker");
    follows_ = false;
    if (*move.to[kNcZ] >= clear_mm - kSame_mm) path_pose_.clear();
    return absl::OkStatus();
  }

  absl::Status Shot(const NcMove& move) {
    if (open_.empty() || !reached_now_ || !Known(move.to))
      return RefuseMove(move, "an output switched on away from every hole", "a hole reached before");
    const Difference difference = From(move.to, open_, !follows_);
    if (!difference.Small()) return RefuseMove(move, "an output switched on away from " + open_, WantedPose());
    return Reach(open_, difference, follows_);
  }

  absl::Status UnmarkedFeed(const NcMove& move) {
    if (open_.empty() || !reached_now_ || !OnlyZ(move) || !Known(move.from) || !Known(move.to))
      return RefuseMove(move, "a feed (G1) that is not marked", "rapid (G0), or a marker");
    const Difference difference = From(move.from, open_, false);
    if (!difference.Small()) return RefuseMove(move, "a feed away from " + open_, WantedPose());
    if (*move.to[kNcZ] >= *move.from[kNcZ]) return absl::OkStatus();  // out of the hole
    if (!follows_)
      return RefuseMove(move, "a depth that does not follow the hole", "steps (G91) from its start, or a marker");
    return Reach(open_, difference);
  }

  absl::Status UnmarkedRapid(const NcMove& move) {
    if (open_.empty()) return absl::OkStatus();
    const NcTarget& target = targets_.at(open_);
    // Steps may go deeper from a start that was reached.
    if (!follows_ && move.to[kNcZ].has_value() && *move.to[kNcZ] < target.z_mm - kSame_mm &&
        !(move.from[kNcZ].has_value() && *move.to[kNcZ] >= *move.from[kNcZ]))
      return RefuseMove(move, "a rapid below the start of " + open_, "a feed (G1) from its start");
    if (!reached_now_ || !Known(move.from)) return absl::OkStatus();
    if (!OnlyZ(move) && *move.from[kNcZ] <= target.z_mm + kSame_mm)
      return RefuseMove(move, "sideways from " + open_, "Z raised first, or a marker");
    if (move.to[kNcZ].has_value() && *move.to[kNcZ] < *move.from[kNcZ] && !follows_)
      return RefuseMove(move, "a rapid down that does not follow " + open_, "steps (G91) from its start, or a marker");
    return absl::OkStatus();
  }

  // Deeper than the start of the hole that was reached last.
  bool InHole(const NcPosition& at) const {
    return !last_reached_.empty() && at[kNcZ].has_value() && *at[kNcZ] < targets_.at(last_reached_).z_mm - kSame_mm;
  }

  absl::Status Reach(const std::string& name, const Difference& difference, bool follows = true) {
    reached_now_ = true;
    follows_ = follows;
    reached_.insert(name);
    last_reached_ = name;
    ++proof.pose_count;
    proof.greatest_difference_um = std::max(proof.greatest_difference_um, difference.um);
    proof.greatest_tilt_deg = std::max(proof.greatest_tilt_deg, difference.tilt_deg);
    return absl::OkStatus();
  }

  absl::Status Leave() const {
    if (open_.empty() || reached_now_) return absl::OkStatus();
    return Refuse("nc_template", open_ + " is left before all axes were at it", WantedPose());
  }

  static std::string WantedPose() { return "X, Y, Z and both rotary axes at the corrected pose, from marked blocks"; }

  const std::map<std::string, NcTarget>& targets_;
  const RotaryAxes& axes_;
  const NcPaths paths_;
  double a_deg_ = std::numeric_limits<double>::quiet_NaN(), b_deg_ = a_deg_;
  Eigen::Isometry3d zero_from_machine_;  // at those
  std::map<std::string, Pose> poses_;    // of targets that were looked at
  std::string open_;                     // whose marked blocks were the last
  bool reached_now_ = false;             // since they began
  bool follows_ = false;  // since then only steps along Z were made: depth counts from the corrected start
  std::set<std::string> reached_;
  std::string last_reached_;
  std::string path_pose_;           // of a path: where the tool stands, or what it leaves; empty: in none
  std::optional<double> above_mm_;  // the highest Z since another axis moved
  double entered_from_mm_ = 0, entered_down_mm_ = 0;  // that Z where a path was begun, and above its first pose
};

}  // namespace

absl::StatusOr<NcProof> ProveProgram(const std::vector<NcMove>& moves, const std::map<std::string, NcTarget>& targets,
                                     const RotaryAxes& axes) {
  if (absl::Status status = CheckPaths(targets); !status.ok()) return status;
  Proof proof(targets, axes);
  for (const NcMove& move : moves)
    if (absl::Status status = proof.Follow(move); !status.ok()) return status;
  if (absl::Status status = proof.End(); !status.ok()) return status;
  return proof.proof;
}

}  // namespace sixpoint::metrology
