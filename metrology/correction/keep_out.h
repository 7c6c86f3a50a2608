// Where the tool goes while it cuts nothing, and whether the part is there (docs/methods/release.md). The part is its CAD at the
// registered pose; a casting stands off it by what its tolerance allows.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "metrology/correction/correct.h"
#include "metrology/correction/nc_reader.h"
#include "metrology/correction/nc_target.h"
#include "metrology/correction/release_gate.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

struct PlacedPart {
  const Surface& surface;
  Eigen::Isometry3d zero_from_part;
  const RotaryAxes& axes;
};

// KEEP_OUT: the tip's distance from the part on every move between known places, but along the axis of a hole that is cut there, and
// from pose to pose of a path, whose electrode is looked at instead (tool_path_clearance.h). A feed goes straight; of a rapid, on which a control may let each axis arrive in its own time, every place between the two ends counts.
// CANCELLED where keep_going (may be empty) says no.
absl::StatusOr<GateCheck> CheckKeepOut(const std::vector<NcMove>& moves, const std::map<std::string, NcTarget>& targets,
                                       const PlacedPart& part, double keep_out_mm,
                                       const std::function<bool()>& keep_going);

// LINE_OF_SIGHT: the distance from the part of each hole's axis above its start, from four times the keep-out on.
// CANCELLED as CheckKeepOut.
absl::StatusOr<GateCheck> CheckLinesOfSight(const std::vector<NominalHoleGroup>& groups, const Surface& surface,
                                            double keep_out_mm, const std::function<bool()>& keep_going);

// TRAVEL: what lies beyond a linear axis's limits.
struct LinearTravel {
  std::string axis;
  Eigen::Vector3d direction;  // of a growing command, machine frame
  double minimum_mm = 0, maximum_mm = 0;
};
// Of holes' starts, and of the moves of a program (empty: none was sent). tip_below_mm: least and greatest of the stated tools'
// lengths; the axes carry the spindle.
GateCheck CheckTravel(const std::vector<CorrectedHoleGroup>& groups, const std::vector<NcMove>& moves,
                      const std::vector<LinearTravel>& travel, const std::array<double, 2>& tip_below_mm);

}  // namespace sixpoint::metrology
