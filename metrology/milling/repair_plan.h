// From the cloud of a blade whose tip was welded on to the mill's path around its target, and what that removes (docs/methods/repair.md).
//
// Part frame, whose z is the blade's span; mm and radians. Thread-safe; the same inputs give the same bits on any number of threads.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <vector>

#include "metrology/milling/recontour_path.h"
#include "metrology/repair/extrapolation.h"

namespace sixpoint::metrology {

// By which a node's standard uncertainty is expanded: a normal value's 95 %.
inline constexpr double kTargetCoverage = 1.959964;

struct RepairOptions {
  StackOptions stack;  // with the drawing's surface
  ExtrapolationMethod extrapolation = ExtrapolationMethod::kProcessOfDeviation;
  double scallop_mm = 0.005;  // finishing laps lie so far apart
  PathOptions path;
  double guard_mm = 0.01;  // kept clear of the measured surface below the line
  double chord_mm = 1e-3;  // of the path between two of its places
  double greatest_turn_rad =
      0.02;  // of the axis, between two of them: a control that leads axes leaves the line by a lever times its square
  double greatest_uncertainty_mm = 0.05;  // expanded, of a node of the target
  std::function<bool()> keep_going = {};
};

// Simulated on the measured outlines near below the line, and on the target's nodes.
struct SimulatedRemoval {
  std::size_t place_count_below = 0;
  double deepest_below_mm = 0;
  double deepest_in_target_mm = 0;
  double deepest_beyond_uncertainty_mm = 0;  // of that, beyond the node's expanded uncertainty
  double greatest_rest_mm = 0, mean_rest_mm = 0;
  std::vector<std::vector<double>> rest_mm;  // of each target section's nodes; below 0: cut into it
};

struct RepairPlan {
  MeasuredStack measured;
  Extrapolation target;                                 // at the finishing laps' heights
  Eigen::Vector2d origin_mm = Eigen::Vector2d::Zero();  // of the sections' frames
  double stock_mm = 0, step_over_mm = 0;
  RecontourPath path;  // with the places that the chord asks for
  SimulatedRemoval removal;
};

// What is cut of the blade's own surface below the line, at most: less than its outlines are measured by.
inline constexpr double kDeepestBelowLine_mm = 1e-3;
// And into the target, beyond what is uncertain of it.
inline constexpr double kDeepestBeyondUncertainty_mm = 1e-3;

// INVALID_ARGUMENT, by name: as MeasureSections, NominalSections, Extrapolate and PlanPath refuse; no drawing; a scallop that no step-over makes; a target that is too
// uncertain ("target"); a
// path that cuts below the line, or into the target beyond its uncertainty ("path"). CANCELLED where the caller is gone.
absl::StatusOr<RepairPlan> PlanRepair(const Points& points_mm, const RepairOptions& options);

// What it refuses whatever the points are.
absl::Status CheckRepair(const RepairOptions& options);

// The closed lap with as few of its places as keep its straight ways within the chord of those left out; moved out along their normals where a way
// would lie nearer to the wall than those did.
std::vector<ToolPlace> Thinned(const std::vector<ToolPlace>& places, double chord_mm, double greatest_turn_rad);

// Of the closed lap, as the ball's centre goes.
double Length_mm(const std::vector<ToolPlace>& places);

}  // namespace sixpoint::metrology
