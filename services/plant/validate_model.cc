// Machining models: each by itself, and against the part that it is of.
#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "metrology/correction/nc_program.h"
#include "metrology/correction/tool_cylinder.h"
#include "metrology/correction/tool_path_clearance.h"
#include "services/plant/checks.h"
#include "services/plant/model_template.h"
#include "services/plant/validate.h"
#include "services/runtime/control_tables.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::plant {
namespace {

using runtime::Refuse;

std::string OperationAt(int i) { return "machining_model.operations[" + std::to_string(i) + "]"; }

constexpr int kMostPathsOfModel = 1000, kMostPosesOfModel = 20'000;
constexpr double kGreatestPathElectrode_mm = metrology::kGreatestPathTool_mm;

absl::Status ReadPoses(const std::string& at, const v1::ToolPath& path, storage::MachiningToolPathRow* row) {
  runtime::Refusals refusals;
  for (int i = 0; i < path.poses_size(); ++i) {
    const v1::ToolPose& pose = path.poses(i);
    const std::string field = at + ".poses[" + std::to_string(i) + "]";
    std::vector<double> tip_mm, axis;
    refusals.Add(Read(field + ".tip_in_part_mm", pose.has_tip_in_part_mm(), pose.tip_in_part_mm(), &tip_mm))
        .Add(Read(field + ".axis_in_part", pose.has_axis_in_part(), pose.axis_in_part(), &axis));
    row->tips_in_part_mm.insert(row->tips_in_part_mm.end(), tip_mm.begin(), tip_mm.end());
    row->axes_in_part.insert(row->axes_in_part.end(), axis.begin(), axis.end());
  }
  return refusals.status();
}

absl::Status ReadPath(const std::string& at, const v1::ToolPath& path, storage::MachiningToolPathRow* row) {
  row->path = path.path();
  row->a_nominal_deg = path.a_nominal_deg();
  row->b_nominal_deg = path.b_nominal_deg();
  row->position_tolerance_mm = path.position_tolerance_mm();
  row->inclination_tolerance_deg = path.inclination_tolerance_deg();
  row->mouth_mm = path.mouth_mm();
  runtime::Refusals refusals;
  refusals.Add(runtime::CheckId(at + ".path", path.path()))
      .Add(CheckRange(at + ".a_nominal_deg", path.a_nominal_deg(), -360, 360, "-360 to 360"))
      .Add(CheckRange(at + ".b_nominal_deg", path.b_nominal_deg(), -360, 360, "-360 to 360"))
      .Add(CheckPositive(at + ".position_tolerance_mm", path.position_tolerance_mm(), 100))
      .Add(CheckPositive(at + ".inclination_tolerance_deg", path.inclination_tolerance_deg(), 90))
      .Add(CheckPositive(at + ".mouth_mm", path.mouth_mm(), metrology::kGreatestMouth_mm));
  if (path.has_greatest_step_deg()) {
    row->greatest_step_deg = path.greatest_step_deg();
    refusals.Add(CheckPositive(at + ".greatest_step_deg", path.greatest_step_deg(), 90));
  }
  const int most = static_cast<int>(metrology::kMostToolPoses);
  if (path.poses_size() < 2 || path.poses_size() > most)
    refusals.Add(Refuse(at + ".poses", std::to_string(path.poses_size()) + " poses", "2 to " + std::to_string(most)));
  else
    refusals.Add(ReadPoses(at, path, row));
  return refusals.status();
}

// What its operations name, each once in a model.
struct NamesOfModel {
  std::set<std::string> operations, groups, paths;
  int pose_count = 0;
};

absl::Status ReadOperation(const std::string& at, const v1::MachiningOperation& one, NamesOfModel* named,
                           storage::MachiningOperationRow* row) {
  const v1::Electrode& electrode = one.electrode();
  row->operation = one.operation();
  row->hole_group = one.hole_group();
  row->electrode_diameter_mm = electrode.diameter_mm();
  row->electrode_length_mm = electrode.length_mm();
  row->electrode_wear_mm = electrode.wear_mm();
  const double widest_mm = one.paths().empty() ? 100 : kGreatestPathElectrode_mm;
  runtime::Refusals refusals;
  refusals.Add(runtime::CheckId(at + ".operation", one.operation()))
      .Add(CheckPositive(at + ".electrode.diameter_mm", electrode.diameter_mm(), widest_mm))
      .Add(CheckPositive(at + ".electrode.length_mm", electrode.length_mm(), 1000))
      .Add(CheckRange(at + ".electrode.wear_mm", electrode.wear_mm(), 0, std::max(0.0, electrode.length_mm()),
                      "0 to length_mm"));
  if (one.has_tool_number()) {
    row->tool_number = one.tool_number();
    refusals.Add(CheckRange(at + ".tool_number", one.tool_number(), 1, 9999, "1 to 9999, or unset"));
  }
  if (one.has_feed_mm_min()) {
    row->feed_mm_min = one.feed_mm_min();
    refusals.Add(CheckPositive(at + ".feed_mm_min", one.feed_mm_min(), 100'000));
  }
  if (!named->operations.insert(one.operation()).second)
    refusals.Add(Refuse(at + ".operation", one.operation(), "a name that no other has"));
  if (one.hole_group().empty() == one.paths().empty())
    refusals.Add(Refuse(at + ".hole_group", one.hole_group().empty() ? "" : one.hole_group() + " beside paths",
                        "a hole group, or else paths"));
  if (!one.hole_group().empty() && !named->groups.insert(one.hole_group()).second)
    refusals.Add(Refuse(at + ".hole_group", one.hole_group(), "each group once"));
  for (int i = 0; i < one.paths_size() && named->paths.size() <= kMostPathsOfModel; ++i) {
    const std::string field = at + ".paths[" + std::to_string(i) + "]";
    refusals.Add(ReadPath(field, one.paths(i), &row->paths.emplace_back()));
    if (!named->paths.insert(one.paths(i).path()).second)
      refusals.Add(Refuse(field + ".path", one.paths(i).path(), "each path once"));
    named->pose_count += one.paths(i).poses_size();
  }
  return refusals.status();
}

absl::Status ReadOperations(const v1::MachiningModel& model, storage::MachiningModelRow* row) {
  if (model.operations().empty()) return Refuse("machining_model.operations", "none", "at least one");
  runtime::Refusals refusals;
  NamesOfModel named;
  for (int i = 0; i < model.operations_size(); ++i)
    refusals.Add(ReadOperation(OperationAt(i), model.operations(i), &named, &row->operations.emplace_back()));
  if (named.paths.size() > kMostPathsOfModel)
    refusals.Add(Refuse("machining_model.operations", "more than " + std::to_string(kMostPathsOfModel) + " paths",
                        "at most as many"));
  if (named.pose_count > kMostPosesOfModel)
    refusals.Add(Refuse("machining_model.operations", std::to_string(named.pose_count) + " poses",
                        "at most " + std::to_string(kMostPosesOfModel) + " of all paths"));
  return refusals.status();
}

// Beside the part: a name of their own, and tips that are no other part's. What they mark is added to `marks`.
absl::Status CheckPaths(const std::string& at, const storage::MachiningOperationRow& operation,
                        const storage::PartRow& part, std::set<std::string>* marks) {
  constexpr double kBeside_mm = 10;
  const auto& low = part.tessellation.minimum_mm;
  const auto& high = part.tessellation.maximum_mm;
  runtime::Refusals refusals;
  for (std::size_t p = 0; p < operation.paths.size(); ++p) {
    const storage::MachiningToolPathRow& path = operation.paths[p];
    const std::string field = at + ".paths[" + std::to_string(p) + "]";
    if (std::any_of(part.hole_groups.begin(), part.hole_groups.end(),
                    [&](const storage::HoleGroupRow& group) { return group.group == path.path; }))
      refusals.Add(Refuse(field + ".path", path.path, "a name that no hole group of parts/" + part.part_id + " has"));
    for (std::size_t i = 0; i < path.tips_in_part_mm.size(); ++i) {
      const double at_mm = path.tips_in_part_mm[i];
      if (i % 3 == 0) marks->insert(path.path + "/" + std::to_string(i / 3 + 1));
      if (at_mm < low[i % 3] - kBeside_mm || at_mm > high[i % 3] + kBeside_mm)
        refusals.Add(Refuse(field + ".poses[" + std::to_string(i / 3) + "].tip_in_part_mm." + "xyz"[i % 3] + "_mm",
                            at_mm,
                            "within " + NumberText(kBeside_mm) + " mm of the CAD's " + NumberText(low[i % 3]) + " to " +
                                NumberText(high[i % 3])));
    }
    // Its own electrode has to be left before the last of them.
    const double lost_mm = operation.electrode_wear_mm * static_cast<double>(operation.paths.size() - 1);
    if (p == 0 && lost_mm >= operation.electrode_length_mm)
      refusals.Add(Refuse(at + ".electrode.length_mm", operation.electrode_length_mm,
                          "more than the " + NumberText(lost_mm) + " mm that its paths wear off before the last"));
  }
  return refusals.status();
}

std::string ContentOf(v1::MachiningModel model) {
  model.clear_nc_template_sha256();  // ours to say
  model.clear_part_revision();
  return ContentSha256(std::move(model));
}

}  // namespace

absl::StatusOr<storage::MachiningModelRow> Validated(const v1::CreateMachiningModelRequest& request) {
  const v1::MachiningModel& model = request.machining_model();
  storage::MachiningModelRow row;
  row.machining_model_id = request.machining_model_id();
  const absl::StatusOr<std::string> part_id = runtime::IdOf("machining_model.part", "parts", model.part());
  if (part_id.ok()) row.part_id = *part_id;
  runtime::Refusals refusals;
  refusals.Add(runtime::CheckId("machining_model_id", row.machining_model_id))
      .Add(part_id.status())
      .Add(ReadOperations(model, &row))
      .Add(runtime::CheckWorkOffsets("machining_model.work_offsets", model.work_offsets()))
      .Add(runtime::CheckToolLengths("machining_model.tool_lengths", model.tool_lengths()));
  if (model.has_w_mm()) {
    row.w_mm = model.w_mm();
    refusals.Add(CheckRange("machining_model.w_mm", model.w_mm(), -10'000, 10'000, "-10000 to 10000, or unset"));
  }
  if (model.nc_template().empty() != model.has_post_processor())
    refusals.Add(Refuse("machining_model.nc_template",
                        model.has_post_processor() ? "one beside a post-processor" : "empty",
                        "the NC program of the nominal part, or else a post_processor"));
  if (model.has_post_processor())
    refusals.Add(ReadPostProcessor(model.post_processor(), &row.post_processor.emplace()));
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  row.nc_template = model.nc_template();
  for (const v1::WorkOffset& one : model.work_offsets())
    row.work_offsets.push_back({one.code(), {one.x_mm(), one.y_mm(), one.z_mm(), one.a_deg(), one.b_deg()}});
  for (const v1::ToolLength& tool : model.tool_lengths()) row.tool_lengths.push_back({tool.number(), tool.length_mm()});
  row.content_sha256 = ContentOf(model);
  return row;
}

absl::Status FitToPart(const storage::PartRow& part, v1::MachiningModel described, storage::MachiningModelRow* model) {
  std::string known;
  for (const storage::HoleGroupRow& group : part.hole_groups) known += (known.empty() ? "" : ", ") + group.group;
  runtime::Refusals refusals;
  std::set<std::string> holes;
  int i = 0;
  for (const storage::MachiningOperationRow& one : model->operations) {
    const std::string at = OperationAt(i++);
    refusals.Add(CheckPaths(at, one, part, &holes));
    if (one.hole_group.empty()) continue;
    const auto group = std::find_if(part.hole_groups.begin(), part.hole_groups.end(),
                                    [&](const storage::HoleGroupRow& row) { return row.group == one.hole_group; });
    if (group == part.hole_groups.end()) {
      refusals.Add(
          Refuse(at + ".hole_group", one.hole_group,
                 "a hole group of parts/" + part.part_id + " (" + (known.empty() ? "it has none" : known) + ")"));
      continue;
    }
    refusals.Add(metrology::CheckElectrode(at + ".electrode",
                                           {one.electrode_diameter_mm, one.electrode_length_mm, one.electrode_wear_mm},
                                           {group->group, group->diameter_mm, group->depth_mm, group->holes.size()}));
    for (const storage::HoleRow& hole : group->holes) holes.insert(group->group + "/" + hole.hole);
  }
  // What is marked is told by the groups.
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  if (model->post_processor) {
    absl::StatusOr<std::string> written = TemplateOf(*model, part);
    if (!written.ok()) return written.status();
    model->nc_template = *std::move(written);
    // Written of other holes it is another model, though it was described by the same words.
    described.set_nc_template(model->nc_template);
    model->content_sha256 = ContentOf(std::move(described));
  }
  return Under("machining_model.", metrology::CheckTemplate(model->nc_template, holes, FrameOf(*model)));
}

}  // namespace sixpoint::plant
