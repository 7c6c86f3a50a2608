// A measuring plan: the sweeps of a line scanner by which a part, or the places about its datum points, are seen, with the beam along the surface's
// normal as near as that goes, reachable, within limits, clear of the part, in an order of little travel (docs/methods/measuring_plan.md).
//
// Frames and units as in plan_scene.h. The same inputs give the same plan on any number of threads.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "metrology/kinematics/joint_chain.h"
#include "metrology/measuring_plan/cover.h"
#include "metrology/measuring_plan/plan_scene.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

struct NamedDisc {
  std::string name;
  SurfaceDisc disc;
};

struct PlanTask {
  const Surface& surface;
  Eigen::Isometry3d zero_from_part;
  JointChain chain;  // with the rotary axes as they were identified; the sensor's pose is its tool's at rest
  SensorPose sensor;
  ScannerOptics optics;
  std::vector<NamedDisc> discs;  // none: the whole part
  PlanOptions options;
  std::vector<Eigen::Isometry3d> neighbours_zero_from_part = {};  // of parts alike that stand beside it in the fixture
};

struct MeasuringPlan {
  std::vector<PlannedPortion> portions;  // in the order of the scans
  std::vector<RegionCoverage> regions;   // as asked for
  double travel_mm = 0;                  // of the linear axes between the sweeps
  double turned_rad = 0;                 // of both rotary axes, together
  double sweep_mm = 0;                   // all sweeps together
};

inline constexpr std::size_t kMostPlanTriangles = 4'000'000;
inline constexpr int kMostPlanPortions = 500;
inline constexpr int kMostPlanDiscs = 50;

// Too little seen is a plan that says so. INVALID_ARGUMENT with field, value and wanted of each: options, sensor, chain or discs that are not
// taken. OUT_OF_RANGE: no sweep at all, with what keeps how much of the surface from being seen. CANCELLED where keep_going says no.
absl::StatusOr<MeasuringPlan> MakeMeasuringPlan(const PlanTask& task);

}  // namespace sixpoint::metrology
