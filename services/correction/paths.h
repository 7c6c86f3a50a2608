// The shaped holes of a machining model, as the tool goes on the blade as it stands. Pure.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "metrology/correction/nc_target.h"
#include "metrology/correction/release_gate.h"
#include "metrology/correction/tool_path.h"
#include "metrology/correction/tool_path_clearance.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::correction {

struct Inputs;

// How a path goes with a shape otherwise than its template with the design (adapt.h).
struct PathAdaptation {
  std::vector<Eigen::Vector3d> template_tips_mm;  // part frame, pose by pose
  double greatest_shift_mm = 0, greatest_turn_rad = 0;
  double gouge_um = 0, rest_um = 0;
  std::optional<double> deepest_compensation_um;  // of a command by a pass before
};

struct ModelPath {
  metrology::NominalToolPath nominal;
  metrology::PathTool tool;
  double mouth_mm = 0;
  metrology::PathContinuity steps;
  std::optional<PathAdaptation> adaptation = {};  // nominal goes with a shape
};

// In the model's order.
absl::StatusOr<std::vector<ModelPath>> PathsOf(const plant::v1::MachiningModel& model);

struct CorrectedPath {
  metrology::CorrectedToolPath path;
  metrology::RotaryAngles ideal;  // of its first pose, on the machine's nominal axes
  double greatest_chord_um = 0;   // between poses
  double greatest_axis_deviation_deg = 0;
  std::optional<PathAdaptation> adaptation;

  // Where its tip is most uncertain: the pose's number, from 0.
  std::size_t WorstPose() const;
  const metrology::CorrectedHole& WorstStart() const { return path.poses[WorstPose()].start; }
};

// As CorrectToolPath refuses, and INVALID_ARGUMENT, with how many poses more do, where the way between two of them leaves what is allowed.
absl::StatusOr<CorrectedPath> CorrectPath(const Inputs& inputs, const ModelPath& path,
                                          const std::function<bool()>& keep_going);

// Each pose as a group of one hole, for what is asked of either: subjects are "F1/7".
std::vector<metrology::NominalHoleGroup> NominalPosesOf(const metrology::NominalToolPath& path);
std::vector<metrology::CorrectedHoleGroup> CorrectedPosesOf(const metrology::CorrectedToolPath& path);
// Where the tool comes to it and leaves it along its axis.
std::vector<metrology::NominalHoleGroup> EndsOf(const metrology::NominalToolPath& path);

void AddTargets(const metrology::CorrectedToolPath& path, std::map<std::string, metrology::NcTarget>* targets);

// Where along the paths the tool is nearest to what it may not cut; the check has its answer for straight holes already, or none.
absl::Status LookAtPaths(const Inputs& inputs, const std::vector<CorrectedPath>& corrected,
                         const std::function<bool()>& keep_going, metrology::GateCheck* check);

}  // namespace sixpoint::correction
