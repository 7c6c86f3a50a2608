// What a measuring plan is made for: a part in a machine, its scanner, and what is asked of the plan.
//
// Frames: machine (the table's: linear joints of the part's side at 0), zero, part, sensor. Units: mm and radians.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/chain_solver.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/measuring_plan/rotary_poses.h"
#include "metrology/measuring_plan/scanner_view.h"
#include "metrology/measuring_plan/sensor_body.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

struct PlanOptions {
  double coverage = 0.95;  // of the area of each region: where it is reached, no further portion is added
  // Between the beam and the surface's normal.
  double greatest_incidence_rad = 60 * kPi / 180;
  // How far a part may stand from where it is planned to: so far within the field's borders it is seen, so much longer are sweeps, and so much wider
  // is the clearance.
  double margin_mm = 1.5;
  double clearance_mm = 5;  // of the scanner's housing from the part
  SensorBody body;
  int most_portions = 100;
  double rotary_travel_mm_per_rad = 60;  // what a turn counts beside the linear axes' way
  int threads = 1;
  std::function<bool()> keep_going;  // may be empty
};

struct PlanScene {
  const Surface& surface;
  Eigen::Isometry3d zero_from_part;
  const ChainSolver& solver;
  RotaryAxes axes;  // of the solver's chain
  ScannerView view;
  const PlanOptions& options;
  std::vector<Eigen::Isometry3d> neighbour_from_part;  // of parts alike beside it: from its frame to theirs

  Eigen::Isometry3d MachineFromPart(const RotaryPose& pose) const {
    return axes.MachineFromZero(pose.a_rad, pose.b_rad) * zero_from_part;
  }
};

}  // namespace sixpoint::metrology
