#include "metrology/correction/keep_out.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

constexpr double kOnAxis = 1e-3;             // mm and deg: a move along a hole's axis is written with four decimals
constexpr double kMostStepsUpAxis = 10'000;  // up a hole's axis
constexpr int kMostLooks = 20'000;  // at the surface, of one move: one that is not told apart by then is too near
constexpr int kMostLooksAtAll = 3'000'000;  // of a program: some seconds
constexpr std::size_t kMostPieces = 4096;

using Position = std::array<double, kNcAxisCount>;  // X, Y, Z in mm, the rotary axes in rad

// Places between two ends.
struct MovePiece {
  Position low, high;
};

std::optional<Position> PositionOf(const NcPosition& at) {
  Position position{};
  for (std::size_t i = 0; i < kNcAxisCount; ++i) {
    if (!at[i].has_value()) return std::nullopt;
    position[i] = *at[i] * (i < 3 ? 1 : kRadPerDeg);
  }
  return position;
}

double DistanceFromBox(const Eigen::Vector3d& point, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return (low - point).cwiseMax(point - high).cwiseMax(0.0).norm();
}

class MoveClearances {
 public:
  MoveClearances(const PlacedPart& part, double keep_out_mm)
      : part_(part), part_from_zero_(part.zero_from_part.inverse()), keep_out_mm_(keep_out_mm) {}

  // Of the whole piece, what is sure: at least the keep-out, or the first place that is nearer. straight: its two ends are
  // joined by a line; else any place between them.
  double Of(const MovePiece& whole, bool straight) {
    std::vector<MovePiece> pieces = {whole};
    double least_mm = std::numeric_limits<double>::infinity();
    for (int looks = 0; !pieces.empty(); ++looks, ++looks_) {
      const MovePiece piece = pieces.back();
      pieces.pop_back();
      std::array<double, kNcAxisCount> reach{};
      const double reach_mm = ReachOf(piece, &reach);
      const double distance_mm = DistanceAt(piece, keep_out_mm_ + reach_mm);
      least_mm = std::min(least_mm, distance_mm);
      if (distance_mm - reach_mm >= keep_out_mm_) continue;
      if (distance_mm < keep_out_mm_) return distance_mm;
      if (looks >= kMostLooks || looks_ >= kMostLooksAtAll || pieces.size() >= kMostPieces)
        return distance_mm - reach_mm;
      Split(piece, reach, straight, &pieces);
    }
    return least_mm;
  }

 private:
  // How far the tip is at most from where it is in the middle, and what each axis adds to that.
  double ReachOf(const MovePiece& piece, std::array<double, kNcAxisCount>* reach) const {
    Eigen::Vector3d middle, half;
    for (int i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(i);
      middle[i] = (piece.low[axis] + piece.high[axis]) / 2;
      half[i] = std::abs(piece.high[axis] - piece.low[axis]) / 2;
      (*reach)[axis] = half[i];
    }
    const double about_a_mm = (middle - part_.axes.a.point_mm).norm() + half.norm();
    const double about_b_mm = about_a_mm + (part_.axes.a.point_mm - part_.axes.b.point_mm).norm();
    (*reach)[3] = std::abs(piece.high[3] - piece.low[3]) / 2 * about_a_mm;
    (*reach)[4] = std::abs(piece.high[4] - piece.low[4]) / 2 * about_b_mm;
    return half.norm() + (*reach)[3] + (*reach)[4];
  }

  // In the middle of the piece; of what is farther than asked_mm something between that and the truth.
  double DistanceAt(const MovePiece& piece, double asked_mm) const {
    const auto middle = [&](std::size_t i) { return (piece.low[i] + piece.high[i]) / 2; };
    const Eigen::Vector3d tip_mm(middle(0), middle(1), middle(kNcZ));
    const Eigen::Vector3d in_part =
        part_from_zero_ * (part_.axes.MachineFromZero(middle(3), middle(4)).inverse() * tip_mm);
    const double from_box_mm = DistanceFromBox(in_part, part_.surface.minimum_mm(), part_.surface.maximum_mm());
    if (from_box_mm >= asked_mm) return from_box_mm;
    const double distance_mm = part_.surface.Closest(in_part).signed_distance_mm;
    return part_.surface.mesh().closed ? distance_mm : std::abs(distance_mm);  // of a sheet nothing is inside
  }

  static void Split(const MovePiece& piece, const std::array<double, kNcAxisCount>& reach, bool straight,
                    std::vector<MovePiece>* pieces) {
    MovePiece first = piece, second = piece;
    const auto widest = static_cast<std::size_t>(std::max_element(reach.begin(), reach.end()) - reach.begin());
    for (std::size_t i = 0; i < kNcAxisCount; ++i)
      if (straight || i == widest) first.high[i] = second.low[i] = (piece.low[i] + piece.high[i]) / 2;
    pieces->push_back(second);
    pieces->push_back(first);
  }

  const PlacedPart& part_;
  const Eigen::Isometry3d part_from_zero_;
  const double keep_out_mm_;
  int looks_ = 0;
};

bool StandsAt(const Position& position, const NcTarget& target) {
  const Position wanted = {target.x_mm, target.y_mm, target.z_mm, target.a_deg * kRadPerDeg, target.b_deg * kRadPerDeg};
  for (std::size_t i = 0; i < kNcAxisCount; ++i)
    if (std::abs(position[i] - wanted[i]) > (i < 3 ? kOnAxis : kOnAxis * kRadPerDeg)) return false;
  return true;
}

// The holes by where their axes stand, so that a move finds its own among thousands.
class HoleAxes {
 public:
  explicit HoleAxes(const std::map<std::string, NcTarget>& targets) {
    for (const auto& [name, target] : targets)
      axes_.push_back({target.x_mm, target.y_mm, target.a_deg * kRadPerDeg, target.b_deg * kRadPerDeg, target.z_mm});
    std::sort(axes_.begin(), axes_.end());
  }
  // Along the axis of a hole that is turned to the tool; no rapid goes down below its start, but by steps.
  bool Hold(const NcMove& move, const Position& from, const Position& to) const {
    for (const std::size_t i : {0u, 1u, 3u, 4u})
      if (std::abs(from[i] - to[i]) > (i < 3 ? kOnAxis : kOnAxis * kRadPerDeg)) return false;
    const auto less = [](const Axis& axis, double x_mm) { return axis[0] < x_mm; };
    for (auto axis = std::lower_bound(axes_.begin(), axes_.end(), to[0] - kOnAxis, less);
         axis != axes_.end() && (*axis)[0] <= to[0] + kOnAxis; ++axis)
      if (std::abs((*axis)[1] - to[1]) <= kOnAxis && std::abs((*axis)[2] - to[3]) <= kOnAxis * kRadPerDeg &&
          std::abs((*axis)[3] - to[4]) <= kOnAxis * kRadPerDeg)
        return move.feed || move.by_steps || to[kNcZ] >= from[kNcZ] || to[kNcZ] >= (*axis)[4] - kOnAxis;
    return false;
  }

 private:
  using Axis = std::array<double, 5>;  // X, Y, the rotary axes, and the start's Z
  std::vector<Axis> axes_;
};

// A feed from a pose of a path to the next one: what the tool does there is looked at with its electrode (tool_path_clearance.h).
bool IsAlongPath(const NcMove& move, const Position& from, const Position& to,
                 const std::map<std::string, NcTarget>& targets) {
  const auto pose = targets.find(move.target);
  if (!move.feed || pose == targets.end() || pose->second.number < 2) return false;
  const auto before = targets.find(pose->second.path + "/" + std::to_string(pose->second.number - 1));
  return before != targets.end() && StandsAt(from, before->second) && StandsAt(to, pose->second);
}

// Where it is worst, of figures that have to be at least a limit.
class Nearest {
 public:
  Nearest(GateCheckKind kind, double limit) { check.kind = kind, check.limit = limit; }
  void Look(const std::string& subject, double value_mm) {
    check.failed_count += value_mm >= check.limit ? 0 : 1;
    if (check.value.has_value() && !(value_mm < *check.value)) return;
    check.value = value_mm;
    check.subject = subject;
  }
  GateCheck check;
};

}  // namespace

absl::StatusOr<GateCheck> CheckKeepOut(const std::vector<NcMove>& moves, const std::map<std::string, NcTarget>& targets,
                                       const PlacedPart& part, double keep_out_mm,
                                       const std::function<bool()>& keep_going) {
  MoveClearances clearances(part, keep_out_mm);
  const HoleAxes holes(targets);
  Nearest nearest(GateCheckKind::kKeepOut, keep_out_mm);
  const double above_mm = (part.surface.maximum_mm() - part.surface.minimum_mm()).norm();
  bool known_once = false;
  for (const NcMove& move : moves) {
    if (keep_going && !keep_going()) return absl::CancelledError("keep-out: the caller went away");
    const std::optional<Position> to = PositionOf(move.to);
    if (!to.has_value()) continue;  // home, or on the way to being known
    // Where the machine comes from before its program has said so is its operator's. Home is above.
    std::optional<Position> from = PositionOf(move.from);
    if (!from.has_value()) {
      NcPosition from_above = move.from;
      from_above[kNcZ] = *move.to[kNcZ] + above_mm;
      from = move.from[kNcZ].has_value() ? std::nullopt : PositionOf(from_above);
    }
    if (from.has_value() && IsAlongPath(move, *from, *to, targets)) continue;
    const std::string line = "line " + std::to_string(move.line);
    if (from.has_value() && holes.Hold(move, *from, *to)) continue;
    if (!from.has_value() && known_once)
      nearest.Look(line, 0);  // it was sent home sideways, and nobody knows over what it comes back
    else
      nearest.Look(line, clearances.Of({from.value_or(*to), *to}, move.feed));
    known_once = true;
  }
  if (!nearest.check.value.has_value()) nearest.check.failed_count = 1;  // no move could be followed
  return nearest.check;
}

absl::StatusOr<GateCheck> CheckLinesOfSight(const std::vector<NominalHoleGroup>& groups, const Surface& surface,
                                            double keep_out_mm, const std::function<bool()>& keep_going) {
  Nearest nearest(GateCheckKind::kLineOfSight, keep_out_mm);
  const double size_mm = (surface.maximum_mm() - surface.minimum_mm()).norm();
  for (const NominalHoleGroup& group : groups) {
    for (const NominalHole& hole : group.holes) {
      if (keep_going && !keep_going()) return absl::CancelledError("lines of sight: the caller went away");
      double least_mm = std::numeric_limits<double>::infinity();
      // On by what is free: nothing can be nearer there.
      for (double height_mm = 4 * keep_out_mm; height_mm < size_mm && least_mm >= keep_out_mm;) {
        const double distance_mm =
            std::abs(surface.Closest(hole.start_in_part_mm + height_mm * group.axis_in_part).signed_distance_mm);
        least_mm = std::min(least_mm, distance_mm);
        height_mm += std::max({distance_mm - keep_out_mm, keep_out_mm / 10, size_mm / kMostStepsUpAxis});
      }
      nearest.Look(group.name + "/" + hole.name, std::min(least_mm, size_mm));
    }
  }
  return nearest.check;
}

GateCheck CheckTravel(const std::vector<CorrectedHoleGroup>& groups, const std::vector<NcMove>& moves,
                      const std::vector<LinearTravel>& travel, const std::array<double, 2>& tip_below_mm) {
  GateCheck check{GateCheckKind::kTravel, "", 0, 0, 0};
  const auto look = [&](const std::string& subject, const Eigen::Vector3d& tip_mm) {
    bool beyond = false;
    for (const LinearTravel& axis : travel) {
      for (const double below_mm : tip_below_mm) {
        const double command_mm = axis.direction.dot(tip_mm + below_mm * Eigen::Vector3d::UnitZ());
        const double excess_mm = std::max(axis.minimum_mm - command_mm, command_mm - axis.maximum_mm);
        if (!(excess_mm > 1e-9)) continue;
        beyond = true;
        if (excess_mm <= *check.value) continue;
        check.value = std::min(excess_mm, 1e9);  // of absurd coordinates too
        check.subject = axis.axis + " at " + subject;
      }
    }
    check.failed_count += beyond;
  };
  for (const CorrectedHoleGroup& group : groups)
    for (const CorrectedHole& hole : group.holes) look(group.name + "/" + hole.name, hole.start_mm);
  for (const NcMove& move : moves)
    if (move.to[0] && move.to[1] && move.to[kNcZ])
      look("line " + std::to_string(move.line), {*move.to[0], *move.to[1], *move.to[kNcZ]});
  return check;
}

}  // namespace sixpoint::metrology
