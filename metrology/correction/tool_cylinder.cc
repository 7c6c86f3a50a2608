#include "metrology/correction/tool_cylinder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kMouthSlack = 1.25;         // curved surfaces rise above the plane that touches them
constexpr double kLeastCosine = 0.25;        // between axis and normal: beyond 75.5 deg a hole has no mouth that ends
constexpr double kMostStepsUpTool = 10'000;  // up a tool

// The least distance of the axis from the surface, less the radius, from the mouth to the holder; the first that is too little.
double ClearanceOf(const ToolCylinder& tool, const Surface& surface, double clearance_mm) {
  const double needed_mm = tool.radius_mm + clearance_mm;
  const double least_step_mm = std::max(needed_mm / 20, tool.length_mm / kMostStepsUpTool);
  double least_mm = std::numeric_limits<double>::infinity();
  // On by what is free: nothing can be nearer there. The holder's end is looked at, too.
  for (double height_mm = MouthHeight_mm(tool, clearance_mm); height_mm <= tool.length_mm;) {
    const Eigen::Vector3d at_mm = tool.start_in_part_mm + height_mm * tool.axis_in_part;
    const double distance_mm = std::abs(surface.Closest(at_mm).signed_distance_mm);
    least_mm = std::min(least_mm, distance_mm - tool.radius_mm);
    if (least_mm < clearance_mm || height_mm == tool.length_mm) break;
    height_mm = std::min(height_mm + std::max(distance_mm - needed_mm, least_step_mm), tool.length_mm);
  }
  return least_mm;
}

}  // namespace

absl::Status CheckElectrode(const std::string& field, const Electrode& electrode, const DrilledHoles& holes) {
  Refusals refusals;
  if (!(electrode.diameter_mm <= holes.diameter_mm))
    refusals.Add(Refuse(field + ".diameter_mm", electrode.diameter_mm,
                        "at most " + NumberText(holes.diameter_mm) + ", the diameter of the holes of " + holes.group));
  const double worn_mm = electrode.wear_mm * (static_cast<double>(holes.count) - 1);
  if (!(electrode.length_mm - worn_mm >= holes.depth_mm))
    refusals.Add(Refuse(field + ".length_mm", electrode.length_mm,
                        "at least " + NumberText(holes.depth_mm + worn_mm) + ": the depth of " + holes.group +
                            " and what is worn before its last hole"));
  return refusals.status();
}

double MouthHeight_mm(const ToolCylinder& tool, double clearance_mm) {
  const double cosine = std::max(tool.axis_in_part.dot(tool.normal_in_part), kLeastCosine);
  return kMouthSlack * (tool.radius_mm + clearance_mm) / cosine;
}

absl::StatusOr<GateCheck> CheckToolCylinders(const std::vector<ToolCylinder>& tools, const Surface& surface,
                                             double clearance_mm, const std::function<bool()>& keep_going) {
  GateCheck check{GateCheckKind::kToolCylinder, "", std::nullopt, clearance_mm, 0};
  const double size_mm = (surface.maximum_mm() - surface.minimum_mm()).norm();
  for (const ToolCylinder& tool : tools) {
    if (keep_going && !keep_going()) return absl::CancelledError("tool cylinders: the caller went away");
    const bool is_told =
        tool.axis_in_part.dot(tool.normal_in_part) > 0 && tool.length_mm > MouthHeight_mm(tool, clearance_mm);
    const double found_mm =
        is_told ? std::min(ClearanceOf(tool, surface, clearance_mm), std::max(size_mm, clearance_mm)) : 0;
    check.failed_count += found_mm >= clearance_mm ? 0 : 1;
    if (check.value.has_value() && !(found_mm < *check.value)) continue;
    check.value = found_mm;
    check.subject = tool.hole;
  }
  if (!check.value.has_value()) check.failed_count = 1;  // no tool: nobody can tell
  return check;
}

}  // namespace sixpoint::metrology
