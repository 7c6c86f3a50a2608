#include "services/correction/repair_program.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "metrology/correction/post_processor.h"
#include "refusal/message_text.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::correction {
namespace {

constexpr std::size_t kMostProgramBytes = 3u << 20;  // what an answer carries
constexpr double kSameSize_mm = 1e-6;

absl::Status CheckRepairsModel(const storage::RepairMethodRow& method, const Inputs& inputs) {
  const std::string& name = inputs.asked.machining_model();
  const plant::v1::MachiningModel& model = *inputs.model;
  runtime::Refusals refusals;
  if (!inputs.groups.empty() || inputs.paths.size() != 1 || model.operations_size() != 1)
    refusals.Add(runtime::Refuse("machining_model",
                                 name + " has " + std::to_string(inputs.groups.size()) + " hole groups, " +
                                     std::to_string(inputs.paths.size()) + " paths",
                                 "one with one operation of one path, which the repair's laps are led by"));
  if (!model.has_post_processor())
    refusals.Add(runtime::Refuse("machining_model", name + " has a template and no post-processor",
                                 "one whose post-processor writes the repair's laps"));
  if (!refusals.status().ok()) return refusals.status();
  const plant::v1::Electrode& tool = model.operations(0).electrode();
  const auto same = [&](const char* field, double value, double wanted) {
    if (std::abs(value - wanted) <= kSameSize_mm) return;
    refusals.Add(runtime::Refuse(std::string("machining_model.operations[0].electrode.") + field, value,
                                 NumberText(wanted) + ", as the mill that the repair was planned for"));
  };
  same("diameter_mm", tool.diameter_mm(), method.mill_diameter_mm);
  same("length_mm", tool.length_mm(), method.mill_length_mm);
  return refusals.status();
}

// One lap as the model's path is led: closed, so that it ends where it began.
ModelPath PathOfLap(const ModelPath& model, std::size_t number, const storage::RepairLapRow& lap) {
  ModelPath path = model;
  path.nominal.name += "-" + std::to_string(number);
  path.nominal.poses.clear();
  const std::size_t count = lap.centres_in_part_mm.size() / 3;
  for (std::size_t i = 0; i <= count; ++i) {
    const std::size_t at = 3 * (i % count);
    metrology::ToolPose& pose = path.nominal.poses.emplace_back();
    for (int k = 0; k < 3; ++k) {
      pose.tip_in_part_mm[k] = lap.centres_in_part_mm[at + static_cast<std::size_t>(k)];
      pose.axis_in_part[k] = lap.axes_in_part[at + static_cast<std::size_t>(k)];
    }
  }
  return path;
}

metrology::PostProcessor PostProcessorOf(const plant::v1::PostProcessor& from) {
  metrology::PostProcessor post;
  if (from.has_axis_words()) {
    const plant::v1::AxisWords& words = from.axis_words();
    post.axis_words = {words.x(), words.y(), words.z(), words.a(), words.b()};
  }
  if (from.has_linear_decimals()) post.linear_decimals = from.linear_decimals();
  if (from.has_rotary_decimals()) post.rotary_decimals = from.rotary_decimals();
  if (from.has_direction_decimals()) post.direction_decimals = from.direction_decimals();
  post.explicit_plus = from.explicit_plus();
  post.directions = from.tool_orientation() == plant::v1::TOOL_ORIENTATION_DIRECTIONS;
  post.semicolon_comments = from.comment_style() == plant::v1::COMMENT_STYLE_SEMICOLON;
  post.leaves_out_repeated = from.leaves_out_repeated();
  post.first_number = from.first_number();
  post.number_step = from.number_step();
  post.program_start = from.program_start();
  post.operation_start = from.operation_start();
  post.path_start = from.path_start();
  post.path_pose = from.path_pose();
  post.path_end = from.path_end();
  post.operation_end = from.operation_end();
  post.program_end = from.program_end();
  return post;
}

absl::StatusOr<std::string> TemplateOfLaps(const plant::v1::MachiningModel& model, const std::vector<ModelPath>& laps) {
  const plant::v1::MachiningOperation& from = model.operations(0);
  metrology::PostOperation operation;
  operation.operation = from.operation();
  if (from.has_tool_number()) operation.tool_number = from.tool_number();
  if (from.has_feed_mm_min()) operation.feed_mm_min = from.feed_mm_min();
  operation.electrode_diameter_mm = from.electrode().diameter_mm();
  operation.electrode_length_mm = from.electrode().length_mm();
  for (const ModelPath& lap : laps)
    operation.paths.push_back({lap.nominal.name, static_cast<int>(lap.nominal.poses.size())});
  auto written = metrology::WriteTemplate(PostProcessorOf(model.post_processor()), {operation}, kMostProgramBytes);
  if (!written.ok()) return Under("machining_model.post_processor.", written.status());
  return written;
}

}  // namespace

absl::Status GoAlongRepair(const ShapeStores& stores, const runtime::Caller& caller, Inputs* inputs) {
  const std::string& name = inputs->asked.repair();
  if (name.empty()) return absl::OkStatus();
  const auto row = runtime::FindRow(*stores.repairs, caller.deadline, "repairs", name, errors::v1::REPAIR_NOT_FOUND);
  if (!row.ok()) return row.status();
  if (row->registration_id != runtime::LastSegment(inputs->registration.name()))
    return runtime::Refuse("repair", name + " is of " + runtime::NameOf("registrations", row->registration_id),
                           "one of " + inputs->registration.name());
  if (absl::Status good = CheckRepairsModel(row->applied, *inputs); !good.ok()) return good;
  const auto laps = stores.repairs->Laps(row->repair_id, caller.deadline);
  if (!laps.ok()) return laps.status();
  if (laps->empty()) return absl::DataLossError("repair " + row->repair_id + ": no laps, want its path");
  const ModelPath model = inputs->paths.front();
  inputs->paths.clear();
  for (const storage::RepairLapRow& lap : *laps)
    inputs->paths.push_back(PathOfLap(model, inputs->paths.size() + 1, lap));
  auto written = TemplateOfLaps(*inputs->model, inputs->paths);
  if (!written.ok()) return written.status();
  inputs->asked.set_nc_template(*std::move(written));
  inputs->looked_at_up_to = row->recorded.sequence;
  return absl::OkStatus();
}

}  // namespace sixpoint::correction
