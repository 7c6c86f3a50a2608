#include "metrology/correction/tool_path_steps.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "metrology/correction/path_motion.h"
#include "metrology/correction/segment_distance.h"
#include "metrology/frames/angles.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// Of a unit direction from the cone that two others span: the sine of its angle from the shortest turn between them.
double SineFromTurn(const Vector3d& direction, const Vector3d& from, const Vector3d& to) {
  const auto from_ray = [&](const Vector3d& ray) {
    return direction.dot(ray) > 0 ? std::fmin(1, direction.cross(ray).norm()) : 1;
  };
  const double nearest = std::fmin(from_ray(from), from_ray(to));
  const Vector3d across = from.cross(to);
  if (across.norm() < 1e-12) return nearest;
  const Vector3d normal = across.normalized();
  const bool between = from.cross(direction).dot(normal) >= 0 && direction.cross(to).dot(normal) >= 0;
  return between ? std::fmin(1, std::abs(direction.dot(normal))) : nearest;
}

// A bound of a distance from a convex set along a motion: between two places it is at most the greater one's, and h^2 / 8 of the motion's
// greatest second derivative, which is how far the motion leaves the line between the two (on which the distance is convex).
double GreatestAlong(const PathMotion& motion, const std::function<double(double)>& distance_at,
                     const std::function<double(double, double)>& bend_between, double resolution) {
  constexpr double kShare = 1e-3;
  constexpr int kMostLooksAtStep = 20'000;
  struct Piece {
    double from, to, distance_from, distance_to, bend;
  };
  std::vector<Piece> pieces;
  double greatest = 0, bound = 0;
  const std::vector<double>& bends = motion.bends();
  for (std::size_t i = 0; i + 1 < bends.size(); ++i) {
    if (!(bends[i] < bends[i + 1])) continue;
    pieces.push_back({bends[i], bends[i + 1], distance_at(bends[i]), distance_at(bends[i + 1]),
                      bend_between(bends[i], bends[i + 1])});
    greatest = std::max({greatest, pieces.back().distance_from, pieces.back().distance_to});
  }
  for (int looks = 0; !pieces.empty(); ++looks) {
    const Piece piece = pieces.back();
    pieces.pop_back();
    const double length = piece.to - piece.from;
    const double at_most = std::fmax(piece.distance_from, piece.distance_to) + piece.bend * length * length / 8;
    if (at_most <= greatest * (1 + kShare) + resolution || looks >= kMostLooksAtStep) {
      bound = std::fmax(bound, at_most);
      continue;
    }
    const double middle = (piece.from + piece.to) / 2, distance = distance_at(middle);
    greatest = std::fmax(greatest, distance);
    pieces.push_back({middle, piece.to, distance, piece.distance_to, piece.bend});
    pieces.push_back({piece.from, middle, piece.distance_from, distance, piece.bend});
  }
  return std::fmax(greatest, bound);
}

struct Allowed {
  double chord_um, axis_deg;
};
Allowed AllowedOf(const NominalToolPath& path, const PathDeviationShares& shares) {
  return {1e3 * shares.position * path.position_tolerance_mm,
          kDegPerRad * shares.inclination * path.inclination_tolerance_rad};
}

PathStep Measured(const PathMotion& motion, int from) {
  constexpr double kResolution_mm = 1e-6, kResolution_rad = 1e-8;
  const PathMotion::Place first = motion.At(0), last = motion.At(1);
  PathStep step;
  step.from = from;
  step.chord_um = 1e3 * GreatestAlong(
                            motion,
                            [&](double share) {
                              return DistanceFromSegment(motion.At(share).tip_in_zero_mm, first.tip_in_zero_mm,
                                                         last.tip_in_zero_mm);
                            },
                            [&](double a, double b) { return motion.RatesBetween(a, b, 0).bend_mm; }, kResolution_mm);
  const double sine = GreatestAlong(
      motion,
      [&](double share) { return SineFromTurn(motion.At(share).axis_in_zero, first.axis_in_zero, last.axis_in_zero); },
      [&](double a, double b) { return std::pow(motion.RatesBetween(a, b, 0).turn_rad, 2); }, kResolution_rad);
  step.axis_deg = kDegPerRad * std::asin(std::fmin(1, sine));
  return step;
}

}  // namespace

absl::StatusOr<std::vector<PathStep>> MeasurePathSteps(const NominalToolPath& path, const CorrectedToolPath& corrected,
                                                       const RotaryAxes& axes, const RotaryPositioning& positioning,
                                                       const PathDeviationShares& shares,
                                                       const std::function<bool()>& keep_going) {
  const std::string prefix = "paths[" + path.name + "].";
  Refusals refusals;
  for (const auto& [field, value] : {std::pair(prefix + "position_tolerance_mm", path.position_tolerance_mm),
                                     {prefix + "inclination_tolerance_rad", path.inclination_tolerance_rad},
                                     {std::string("shares.position"), shares.position},
                                     {std::string("shares.inclination"), shares.inclination}})
    if (!(value > 0 && std::isfinite(value))) refusals.Add(Refuse(field, value, "> 0"));
  if (corrected.poses.size() != path.poses.size())
    refusals.Add(Refuse(prefix + "poses", std::to_string(corrected.poses.size()) + " corrected",
                        std::to_string(path.poses.size())));
  refusals.Add(CheckPoseCount(path));
  if (!refusals.status().ok()) return refusals.status();
  const Allowed allowed = AllowedOf(path, shares);
  std::vector<PathStep> steps;
  for (std::size_t i = 0; i + 1 < corrected.poses.size(); ++i) {
    if (keep_going && !keep_going()) return absl::CancelledError("steps of a path: the caller went away");
    const PathMotion motion(corrected.poses[i], corrected.poses[i + 1], axes, positioning);
    PathStep& step = steps.emplace_back(Measured(motion, static_cast<int>(i)));
    const double excess = std::fmax(step.chord_um / allowed.chord_um, step.axis_deg / allowed.axis_deg);
    constexpr double kMargin = 1.05;  // the bend is not the same all the way
    constexpr double kMost = 1e6;
    if (excess > 1) step.more_poses = static_cast<int>(std::fmin(kMost, std::ceil(kMargin * std::sqrt(excess))) - 1);
  }
  return steps;
}

absl::Status CheckPathSteps(const NominalToolPath& path, const std::vector<PathStep>& steps,
                            const PathDeviationShares& shares) {
  const Allowed allowed = AllowedOf(path, shares);
  Refusals refusals;
  for (const PathStep& step : steps) {
    if (step.more_poses == 0) continue;
    refusals.Add(Refuse("paths[" + path.name + "].poses[" + std::to_string(step.from) + "]",
                        "to the next one " + Rounded(step.chord_um) + " um from the line, " + Rounded(step.axis_deg) +
                            " deg from the turn",
                        "at most " + Rounded(allowed.chord_um) + " um and " + Rounded(allowed.axis_deg) +
                            " deg: " + std::to_string(step.more_poses) + " more between the two"));
  }
  return refusals.status();
}

}  // namespace sixpoint::metrology
