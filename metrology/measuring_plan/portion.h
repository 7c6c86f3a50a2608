// One sweep of a measuring plan, and where the machine's axes stand for it.
//
// Frames and units as in plan_scene.h. Pure and thread-safe.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <string>

#include "metrology/measuring_plan/plan_scene.h"

namespace sixpoint::metrology {

struct PlannedPortion {
  std::string region;
  RotaryPose pose;
  Eigen::Vector3d v0_mm = Eigen::Vector3d::Zero();  // as the scan's header states it; the encoder's reading is 0 there
  double length_mm = 0;                             // the encoder's reading at the end
  double seen_mm2 = 0;                              // of its region's surface
  // Of all joints, in the order of the chain: where it comes down to the start, sweeps from there to the end, and goes up again.
  Eigen::VectorXd enter, start, end, leave;
};

// Why a sweep cannot be made.
enum class Obstacle { kNone, kTravel, kClearance };

class PortionPlacer {
 public:
  // INVALID_ARGUMENT: a body without size. The scene outlives it.
  static absl::StatusOr<PortionPlacer> Make(const PlanScene& scene);

  // Positions of a portion that has its pose, v0 and length: kTravel where a linear joint would have to go beyond its limits, above start or end too;
  // kClearance where the housing comes nearer to the part than is allowed, on the sweep or on the way down to it and up.
  Obstacle Place(PlannedPortion* portion) const;

  // From the one's end to the other's start, never nearer to the part than allowed: at the level of the higher of both where nothing turns and that is
  // clear, else above all that the part may sweep while it turns. Machine Z of the sensor frame's origin.
  double TransferHeight_mm(const PlannedPortion& from, const PlannedPortion& to) const;
  // What that way counts.
  double Travel_mm(const PlannedPortion& from, const PlannedPortion& to) const;
  // Sets leave of the one and enter of the other. The joints' limits let them: both lie between places that Place has found within them.
  void Join(PlannedPortion* from, PlannedPortion* to) const;

 private:
  explicit PortionPlacer(const PlanScene& scene) : scene_(scene) {}
  Eigen::Vector3d StartOrigin(const PlannedPortion& portion) const;
  Eigen::Vector3d EndOrigin(const PlannedPortion& portion) const;
  absl::StatusOr<Eigen::VectorXd> Positions(const RotaryPose& pose, const Eigen::Vector3d& origin_mm) const;
  bool IsClear(const RotaryPose& pose, TurnedBox box) const;

  const PlanScene& scene_;
  double safe_height_mm_ = 0;  // of the origin: the housing stays above the ball that the part turns in
};

}  // namespace sixpoint::metrology
