// The 5-axis path of a ball-end mill that machines a weld down to a target contour (docs/methods/repair.md).
//
// Part frame, whose z is the blade's span; mm and radians. Thread-safe; the same inputs give the same bits.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/repair/target_contour.h"

namespace sixpoint::metrology {

struct BallMill {
  double radius_mm = 3;
  double length_mm = 40;  // of the shank behind the ball's centre, as thick as the ball
};

enum class NormalMethod {
  kPublished,  // feed x z, the feed from the neighbours' secant, smoothed: within the section's plane
  kSurface,    // of the target's surface: the contour's own normal, leaning as neighbouring contours lean
};

struct PathOptions {
  BallMill mill;
  double lead_rad = 0;    // of the axis from the normal towards the feed
  double tilt_rad = 0.9;  // and towards the blade's z
  NormalMethod normals = NormalMethod::kSurface;
  double smooth_mm = 0.15;           // along the contour: over so much published normals are averaged, one sigma
  double depth_of_cut_mm = 0.5;      // of a roughing layer, at most
  double finish_allowance_mm = 0.1;  // what roughing leaves
  double roughing_step_mm = 1;       // between roughing passes, at most
};

// One place of the path, which goes on straight to the next.
struct ToolPlace {
  Eigen::Vector3d contact_mm = Eigen::Vector3d::Zero();  // on the target
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();     // outward, unit
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();   // of the ball: the tool centre point
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();       // unit, from the ball to the shank
  double lifted_mm =
      0;  // along the normal beyond the layer's allowance, so that nothing below the repair line is touched
};

// Between two places of a pass, at most.
inline constexpr double kPlaceSpacing_mm = 0.1;

// Around the blade once; its last place is followed by its first.
struct RecontourPass {
  double z_mm = 0;
  double allowance_mm = 0;  // left on the target; 0: finishing
  std::vector<ToolPlace> places;
};

struct RecontourPath {
  std::vector<RecontourPass>
      passes;  // in the order of the cut: layer by layer, each from the tip down to the repair line
  std::size_t roughing_layers = 0;
  double scallop_mm = 0;  // between finishing passes, greatest
};

// Of two passes of a ball b apart on a flat wall, how high a ridge stays; and how far apart they may be for a ridge of h. Absent: no such ridge,
// for they are farther apart than the ball is thick, or h is not between 0 and its radius.
std::optional<double> ScallopOf(double step_over_mm, double radius_mm);
std::optional<double> StepOverFor(double scallop_mm, double radius_mm);

// Evenly from the repair line to the target's top, both included, no farther apart than the step-over.
std::vector<double> PassHeights(double cutoff_mm, double target_mm, double step_over_mm);

// What the mill must not touch: points of the surface below the repair line, and how much is kept clear of each.
struct GuardedSurface {
  Points points_mm;
  std::vector<double> margin_mm;
  Points normals = {};  // of GuardBelow: outward, within the outlines' planes
};
// Of the measured outlines below a height, made denser between them; only what a mill above the line could reach. Up to the line goes on what the
// target is there, for the last outline lies half a slab below it. margin_mm: the outlines' own expanded uncertainty.
GuardedSurface GuardBelow(const std::vector<BladeSection>& measured, const TargetSection& at_line,
                          const Eigen::Vector2d& origin_mm, double reach_mm, double margin_mm);

// The scanned weld over the target, point by point along the target's normals.
struct WeldStock {
  double greatest_mm = 0;  // 0 where none stands above it
  double seen_part = 0;    // of the target's contours, millimetre by millimetre of each: where a point lies beside it
};
WeldStock WeldStockOf(const std::vector<TargetSection>& target, const Eigen::Vector2d& origin_mm,
                      const Points& weld_points_mm);

// target: at the finishing passes' heights, all with as many nodes. INVALID_ARGUMENT, by name: lead or tilt beyond 75 deg, sizes that are not
// positive, passes farther apart than the ball is thick, a mill too thick for the target's hollow side.
absl::StatusOr<RecontourPath> PlanPath(const std::vector<TargetSection>& target, const Eigen::Vector2d& origin_mm,
                                       double stock_mm, const GuardedSurface& guard, const PathOptions& options,
                                       int thread_count);

// The published direction of the axis in the frame of feed, normal and n x feed (with the square root that the publication lost).
Eigen::Vector3d ToolAxis(const Eigen::Vector3d& feed, const Eigen::Vector3d& normal, double lead_rad, double tilt_rad);

}  // namespace sixpoint::metrology
