#include "services/correction/paths.h"

#include <algorithm>

#include "metrology/correction/path_draws.h"
#include "metrology/correction/start_uncertainty.h"
#include "metrology/correction/tool_path_steps.h"
#include "services/correction/inputs.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::correction {
namespace {

// From pose to pose. A rotary axis that swings while the tool hardly turns has jumped; linear axes follow it on a lever of half a metre at most.
constexpr double kUsualStep_deg = 10, kTurnsOfTool = 4, kLever_mm = 500;
metrology::PathContinuity StepsOf(double step_deg) {
  const double step_rad = step_deg * runtime::kRadPerDeg;
  return {{step_rad, 0, kTurnsOfTool}, {kLever_mm * step_rad, 2, kLever_mm * kTurnsOfTool}};
}

absl::StatusOr<ModelPath> PathOf(const std::string& field, const plant::v1::ToolPath& path,
                                 const plant::v1::Electrode& electrode) {
  ModelPath out;
  out.nominal.name = path.path();
  out.nominal.nominal = {path.a_nominal_deg() * runtime::kRadPerDeg, path.b_nominal_deg() * runtime::kRadPerDeg};
  out.nominal.position_tolerance_mm = path.position_tolerance_mm();
  out.nominal.inclination_tolerance_rad = path.inclination_tolerance_deg() * runtime::kRadPerDeg;
  for (int i = 0; i < path.poses_size(); ++i) {
    const std::string at = field + ".poses[" + std::to_string(i) + "]";
    const auto tip = runtime::FromProto(at + ".tip_in_part_mm", path.poses(i).tip_in_part_mm());
    if (!tip.ok()) return tip.status();
    const auto axis = runtime::FromProto(at + ".axis_in_part", path.poses(i).axis_in_part());
    if (!axis.ok()) return axis.status();
    out.nominal.poses.push_back({*tip, *axis});
  }
  out.tool = {electrode.diameter_mm(), electrode.length_mm()};
  out.mouth_mm = path.mouth_mm();
  out.steps = StepsOf(path.has_greatest_step_deg() ? path.greatest_step_deg() : kUsualStep_deg);
  return out;
}

// What a program's tip goes away from is where its template has it, so that an envelope sees the shape's way too.
void AsTemplate(const Inputs& inputs, const metrology::NominalToolPath& nominal, const PathAdaptation& adaptation,
                metrology::CorrectedToolPath* path) {
  for (std::size_t i = 0; i < path->poses.size(); ++i) {
    metrology::CorrectedToolPose& pose = path->poses[i];
    const Eigen::Vector3d back_mm = adaptation.template_tips_mm[i] - nominal.poses[i].tip_in_part_mm;
    const metrology::RotaryAngles& at = pose.nominal_angles;
    pose.start.nominal_start_mm += inputs.rotation.axes.MachineFromZero(at.a_rad, at.b_rad).linear() *
                                   inputs.zero_from_part_nominal.linear() * back_mm;
  }
}

}  // namespace

absl::StatusOr<std::vector<ModelPath>> PathsOf(const plant::v1::MachiningModel& model) {
  std::vector<ModelPath> paths;
  for (int i = 0; i < model.operations_size(); ++i)
    for (int k = 0; k < model.operations(i).paths_size(); ++k) {
      auto path = PathOf("machining_model.operations[" + std::to_string(i) + "].paths[" + std::to_string(k) + "]",
                         model.operations(i).paths(k), model.operations(i).electrode());
      if (!path.ok()) return path.status();
      paths.push_back(*std::move(path));
    }
  return paths;
}

std::size_t CorrectedPath::WorstPose() const {
  const auto worst = std::max_element(path.poses.begin(), path.poses.end(), [](const auto& a, const auto& b) {
    return a.start.expanded_uncertainty_um < b.start.expanded_uncertainty_um;
  });
  return static_cast<std::size_t>(worst - path.poses.begin());
}

absl::StatusOr<CorrectedPath> CorrectPath(const Inputs& inputs, const ModelPath& path,
                                          const std::function<bool()>& keep_going) {
  const metrology::RotaryAxes& axes = inputs.rotation.axes;
  auto corrected = metrology::CorrectToolPath(path.nominal, *inputs.pose, inputs.zero_from_part_nominal, axes,
                                              inputs.machine_axes.limits, path.steps, inputs.drilling,
                                              inputs.machine_axes.letters, keep_going);
  if (!corrected.ok()) return corrected.status();
  const auto steps =
      metrology::MeasurePathSteps(path.nominal, *corrected, axes, inputs.pose->positioning, {}, keep_going);
  if (!steps.ok()) return steps.status();
  if (absl::Status exact = metrology::CheckPathSteps(path.nominal, *steps); !exact.ok()) return exact;
  const auto ideal = metrology::Orient(inputs.machine_axes.nominal,
                                       inputs.pose->zero_from_part.linear() * path.nominal.poses.front().axis_in_part,
                                       path.nominal.nominal, inputs.machine_axes.limits,
                                       metrology::AllowedTiltOf(path.nominal.inclination_tolerance_rad));
  if (!ideal.ok()) return ideal.status();
  CorrectedPath out;
  out.path = *std::move(corrected);
  out.ideal = *ideal;
  for (const metrology::PathStep& step : *steps) {
    out.greatest_chord_um = std::max(out.greatest_chord_um, step.chord_um);
    out.greatest_axis_deviation_deg = std::max(out.greatest_axis_deviation_deg, step.axis_deg);
  }
  out.adaptation = path.adaptation;
  if (path.adaptation.has_value()) AsTemplate(inputs, path.nominal, *path.adaptation, &out.path);
  return out;
}

std::vector<metrology::NominalHoleGroup> NominalPosesOf(const metrology::NominalToolPath& path) {
  std::vector<metrology::NominalHoleGroup> poses;
  for (std::size_t i = 0; i < path.poses.size(); ++i) poses.push_back(metrology::NominalPoseOf(path, i));
  return poses;
}

std::vector<metrology::CorrectedHoleGroup> CorrectedPosesOf(const metrology::CorrectedToolPath& path) {
  std::vector<metrology::CorrectedHoleGroup> poses;
  for (const metrology::CorrectedToolPose& pose : path.poses)
    poses.push_back(metrology::CorrectedPoseOf(path.name, pose));
  return poses;
}

std::vector<metrology::NominalHoleGroup> EndsOf(const metrology::NominalToolPath& path) {
  std::vector<metrology::NominalHoleGroup> poses = NominalPosesOf(path);
  return {poses.front(), poses.back()};
}

void AddTargets(const metrology::CorrectedToolPath& path, std::map<std::string, metrology::NcTarget>* targets) {
  int number = 0;
  for (const metrology::CorrectedToolPose& pose : path.poses) {
    const Eigen::Vector3d& tip = pose.start.start_mm;
    ++number;
    (*targets)[path.name + "/" + std::to_string(number)] = {tip.x(),
                                                            tip.y(),
                                                            tip.z(),
                                                            pose.corrected.a_rad / runtime::kRadPerDeg,
                                                            pose.corrected.b_rad / runtime::kRadPerDeg,
                                                            path.name,
                                                            number};
  }
}

absl::Status LookAtPaths(const Inputs& inputs, const std::vector<CorrectedPath>& corrected,
                         const std::function<bool()>& keep_going, metrology::GateCheck* check) {
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    const ModelPath& path = inputs.paths[i];
    const auto clearances = metrology::MeasurePathClearances(
        path.nominal, corrected[i].path, *inputs.pose, inputs.rotation.axes, inputs.drilling, path.tool,
        {path.mouth_mm, check->limit}, *inputs.surface, keep_going);
    if (!clearances.ok()) return clearances.status();
    for (const metrology::PathClearance& one : *clearances) {
      check->failed_count += one.clearance_mm >= check->limit ? 0 : 1;
      if (check->value.has_value() && !(one.clearance_mm < *check->value)) continue;
      check->value = one.clearance_mm;
      check->subject = path.nominal.name + "/" + std::to_string(one.from + 1);
    }
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::correction
