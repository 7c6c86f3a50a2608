// Whether an electrode, while it stands in its hole, keeps away from the part beside that hole (docs/methods/release.md). The part is its
// CAD; the electrode is a cylinder up to its holder.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "metrology/correction/release_gate.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// What drills the straight holes of a group, and what their drawing says of them.
struct Electrode {
  double diameter_mm = 0;
  double length_mm = 0;  // from the tip to the holder, as new
  double wear_mm = 0;    // of the length, lost after each hole
};
struct DrilledHoles {
  std::string group;  // as a refusal calls it
  double diameter_mm = 0, depth_mm = 0;
  std::size_t count = 0;
};
// INVALID_ARGUMENT with field + ".diameter_mm": wider than the holes; field + ".length_mm": less than their depth is left before the last.
absl::Status CheckElectrode(const std::string& field, const Electrode& electrode, const DrilledHoles& holes);

// An electrode whose tip is at its hole's start: there it stands out farthest. Part frame, unit vectors.
struct ToolCylinder {
  std::string hole;                  // "G1/H3"
  Eigen::Vector3d start_in_part_mm;  // of the hole, on the surface
  Eigen::Vector3d axis_in_part;      // out of the part
  Eigen::Vector3d normal_in_part;    // of the surface at the start, outward
  double radius_mm = 0;
  double length_mm = 0;  // from the tip to the holder
};

// TOOL_CYLINDER: the least distance of the cylinders from the part outside their own holes' mouths, in mm, at least clearance_mm. The mouth
// reaches up the axis until a cylinder with its clearance stands free of the plane that touches the surface at the start, and a quarter
// farther; a plane nearer to the axis than 14.5 deg counts as one at 14.5 deg. A normal that looks into the part, along the axis, has no
// mouth, and a tool that ends in its mouth leaves nobody who could tell: neither passes, and both are of clearance 0. CANCELLED where keep_going (may be empty) says no.
absl::StatusOr<GateCheck> CheckToolCylinders(const std::vector<ToolCylinder>& tools, const Surface& surface,
                                             double clearance_mm, const std::function<bool()>& keep_going);

// Where up its axis a tool has left its hole's mouth.
double MouthHeight_mm(const ToolCylinder& tool, double clearance_mm);

}  // namespace sixpoint::metrology
