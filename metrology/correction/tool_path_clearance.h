// Whether the tool cuts where it should not, along a path: its cylinder at every pose and between them against the part's CAD, beside the
// mouth of the hole that it is to cut (docs/methods/correction.md, tool paths).
//
// Frames: part. Units: mm. The same inputs give the same bits.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <vector>

#include "metrology/correction/tool_path.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// An electrode: a cylinder about the tool's axis from the tip to the holder. Both ends count as round: half a ball beyond each.
struct PathTool {
  double diameter_mm = 0;
  double length_mm = 0;  // from the tip to the holder
};

// The mouth is what the path may cut: every place of the surface no farther than the electrode's radius and mouth_mm from a tip of the
// nominal path, or from the line between two of them. A tool that leans by the angle e from the surface (90 deg: upright) leaves
// it at radius / sin(e) from its tip, so that mouth_mm has to be at least (radius + clearance_mm) / sin(e) - radius, and more where tips are below it.
struct PathClearanceLimits {
  double mouth_mm = 0;
  double clearance_mm = 0;  // of the cylinder from all else; less than mouth_mm
};

// Of holes, and of what is cut around them. More are not taken: the surface about the rim is looked at in pieces.
inline constexpr double kGreatestMouth_mm = 10, kGreatestPathTool_mm = 10;

// From a pose to the next one, both counted; of a path with one pose that.
struct PathClearance {
  int from = 0;  // pose, from 0
  double clearance_mm =
      0;             // below 0: within the part. Of what passes, the least that was looked at: none is below the limit
  double share = 0;  // of the way to the next pose, where it is so near
  double height_mm = 0;  // above the tip
};

// By halving: a place is looked at in the middle of a piece of the way and of the tool's length, and no other one of the piece is nearer by more
// than the tool moves there; what is not told by 20,000 looks counts as nearer. The CAD's triangles are taken as flat. A closed part
// holds no holder's end within it. INVALID_ARGUMENT, with field, value and wanted: a tool without size, limits out of order, paths of different
// lengths, more than is taken (kMostToolPoses and above; "paths[NAME].mouth": kMostMouthHalvings). CANCELLED where keep_going (may be empty) says no.
absl::StatusOr<std::vector<PathClearance>> MeasurePathClearances(
    const NominalToolPath& path, const CorrectedToolPath& corrected, const RegisteredPose& pose, const RotaryAxes& axes,
    const Drilling& drilling, const PathTool& tool, const PathClearanceLimits& limits, const Surface& surface,
    const std::function<bool()>& keep_going);

}  // namespace sixpoint::metrology
