#include "services/correction/model.h"

#include <algorithm>
#include <set>

#include "refusal/message_text.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::correction {
namespace {

std::string RevisedName(const plant::v1::MachiningModel& model) {
  return runtime::RevisedName("machining_models", runtime::LastSegment(model.name()), model.revision());
}

const plant::v1::Joint* JointW(const plant::v1::Kinematics& kinematics) {
  for (const auto* side : {&kinematics.part_side(), &kinematics.tool_side()})
    for (const plant::v1::Joint& joint : *side)
      if (joint.axis() == "W") return &joint;
  return nullptr;
}

}  // namespace

absl::StatusOr<std::optional<plant::v1::MachiningModel>> FetchModel(const clients::PlantClient& plant,
                                                                    const v1::CorrectRequest& request,
                                                                    const runtime::Caller& caller) {
  if (request.machining_model().empty()) return std::nullopt;
  auto model = plant.GetMachiningModel(request.machining_model(), caller.make_context());
  if (!model.ok()) return model.status();
  return *std::move(model);
}

absl::StatusOr<v1::CorrectRequest> WithModel(const v1::CorrectRequest& request,
                                             const plant::v1::MachiningModel& model) {
  std::set<std::string> asked(request.groups().begin(), request.groups().end());
  std::string known;
  int known_count = 0;
  const auto has = [&](const std::string& name) {
    known += (known.empty() ? "" : ", ") + name;
    ++known_count;
    asked.erase(name);
  };
  v1::CorrectRequest filled = request;
  filled.clear_groups();
  for (const plant::v1::MachiningOperation& operation : model.operations()) {
    for (const plant::v1::ToolPath& path : operation.paths()) has(path.path());
    if (operation.hole_group().empty()) continue;
    has(operation.hole_group());
    filled.add_groups(operation.hole_group());
  }
  for (int i = 0; i < request.groups_size(); ++i)
    if (asked.count(request.groups(i)) > 0)
      return runtime::Refuse("groups[" + std::to_string(i) + "]", request.groups(i),
                             "a hole group or path of " + RevisedName(model) + " (" + known + ")");
  // Its template marks the holes of all.
  if (request.groups_size() > 0 && request.groups_size() < known_count)
    return runtime::Refuse("groups", std::to_string(request.groups_size()) + " of them",
                           "none, or all of " + RevisedName(model) + " (" + known + ")");
  filled.set_machining_model(RevisedName(model));
  filled.set_nc_template(model.nc_template());
  for (const plant::v1::WorkOffset& one : model.work_offsets()) {
    v1::WorkOffset& out = *filled.add_work_offsets();
    out.set_code(one.code());
    out.set_x_mm(one.x_mm());
    out.set_y_mm(one.y_mm());
    out.set_z_mm(one.z_mm());
    out.set_a_deg(one.a_deg());
    out.set_b_deg(one.b_deg());
  }
  for (const plant::v1::ToolLength& one : model.tool_lengths()) {
    v1::ToolLength& out = *filled.add_tool_lengths();
    out.set_number(one.number());
    out.set_length_mm(one.length_mm());
  }
  return filled;
}

absl::Status CheckModel(const plant::v1::MachiningModel& model, const std::string& part,
                        const plant::v1::Machine& machine) {
  runtime::Refusals refusals;
  if (model.part() != part)
    refusals.Add(
        runtime::Refuse("machining_model", RevisedName(model) + " of " + model.part(), "a machining model of " + part));
  if (!model.has_w_mm()) return refusals.status();
  const plant::v1::Joint* const w = JointW(machine.kinematics());
  if (w == nullptr)
    refusals.Add(runtime::Refuse("machining_model.w_mm", model.w_mm(),
                                 "a model that states none: the kinematics of " + machine.name() + " have no joint W"));
  else if (model.w_mm() < w->minimum() || model.w_mm() > w->maximum())
    refusals.Add(runtime::Refuse(
        "machining_model.w_mm", model.w_mm(),
        NumberText(w->minimum()) + " to " + NumberText(w->maximum()) + ", the limits of W of " + machine.name()));
  return refusals.status();
}

void AddPostProcessor(const plant::v1::MachiningModel& model, const MachineAxes& axes, metrology::NcFrame* frame) {
  if (!model.has_post_processor()) return;
  const plant::v1::AxisWords& words = model.post_processor().axis_words();
  frame->axis_words = {words.x(), words.y(), words.z(), words.a(), words.b()};
  if (model.post_processor().tool_orientation() == plant::v1::TOOL_ORIENTATION_DIRECTIONS)
    frame->transformation = axes.nominal;
}

absl::StatusOr<std::vector<GroupElectrode>> ElectrodesOf(const plant::v1::MachiningModel& model,
                                                         const plant::v1::Part& part) {
  std::vector<GroupElectrode> electrodes;
  for (int i = 0; i < model.operations_size(); ++i) {
    const plant::v1::MachiningOperation& operation = model.operations(i);
    const auto group =
        std::find_if(part.hole_groups().begin(), part.hole_groups().end(),
                     [&](const plant::v1::HoleGroup& one) { return one.group() == operation.hole_group(); });
    if (group == part.hole_groups().end()) continue;  // another revision's; refused where it is asked for
    const plant::v1::Electrode& electrode = operation.electrode();
    // Compared with the part of then when the model was made; this revision may have narrower, deeper or more holes.
    const absl::Status does =
        metrology::CheckElectrode("machining_model.operations[" + std::to_string(i) + "].electrode",
                                  {electrode.diameter_mm(), electrode.length_mm(), electrode.wear_mm()},
                                  {group->group() + " of this revision of " + part.name(), group->diameter_mm(),
                                   group->depth_mm(), static_cast<std::size_t>(group->holes_size())});
    if (!does.ok()) return does;
    GroupElectrode& out = electrodes.emplace_back();
    out.group = group->group();
    out.diameter_mm = electrode.diameter_mm();
    out.length_mm = electrode.length_mm();
    for (const plant::v1::Hole& hole : group->holes()) {
      const auto normal = runtime::FromProto(
          "part.hole_groups." + group->group() + "." + hole.hole() + ".normal_in_part", hole.normal_in_part());
      if (!normal.ok()) return normal.status();
      out.normals_in_part[hole.hole()] = *normal;
    }
  }
  return electrodes;
}

std::vector<metrology::ToolCylinder> ToolsOf(const std::vector<GroupElectrode>& electrodes,
                                             const std::vector<metrology::NominalHoleGroup>& groups) {
  std::vector<metrology::ToolCylinder> tools;
  for (const metrology::NominalHoleGroup& group : groups) {
    const auto electrode = std::find_if(electrodes.begin(), electrodes.end(),
                                        [&](const GroupElectrode& one) { return one.group == group.name; });
    if (electrode == electrodes.end()) continue;
    for (const metrology::NominalHole& hole : group.holes) {
      metrology::ToolCylinder& tool = tools.emplace_back();
      tool.hole = group.name + "/" + hole.name;
      tool.start_in_part_mm = hole.start_in_part_mm;
      tool.axis_in_part = group.axis_in_part;
      const auto normal = electrode->normals_in_part.find(hole.name);
      tool.normal_in_part = normal == electrode->normals_in_part.end() ? group.axis_in_part : normal->second;
      tool.radius_mm = electrode->diameter_mm / 2;
      tool.length_mm = electrode->length_mm;
    }
  }
  return tools;
}

}  // namespace sixpoint::correction
