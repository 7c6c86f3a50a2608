#include "services/plant/model_template.h"

#include <algorithm>
#include <utility>

#include "metrology/correction/post_processor.h"
#include "services/plant/checks.h"

namespace sixpoint::plant {
namespace {

constexpr std::size_t kMostTemplateBytes = 1048576;  // as bounds of nc_template

metrology::PostProcessor KernelOf(const storage::PostProcessorRow& row) {
  metrology::PostProcessor post;
  std::copy_n(row.axis_words.begin(), std::min(row.axis_words.size(), post.axis_words.size()), post.axis_words.begin());
  post.linear_decimals = row.linear_decimals;
  post.rotary_decimals = row.rotary_decimals;
  post.direction_decimals = row.direction_decimals;
  post.explicit_plus = row.explicit_plus;
  post.directions = row.directions;
  post.semicolon_comments = row.semicolon_comments;
  post.leaves_out_repeated = row.leaves_out_repeated;
  post.first_number = row.first_number;
  post.number_step = row.number_step;
  post.program_start = row.program_start;
  post.operation_start = row.operation_start;
  post.hole = row.hole;
  post.path_start = row.path_start;
  post.path_pose = row.path_pose;
  post.path_end = row.path_end;
  post.operation_end = row.operation_end;
  post.program_end = row.program_end;
  return post;
}

}  // namespace

absl::Status ReadPostProcessor(const v1::PostProcessor& post, storage::PostProcessorRow* row) {
  runtime::Refusals refusals;
  row->axis_words = {"X", "Y", "Z", "A", "B"};
  if (post.has_axis_words()) {
    const v1::AxisWords& words = post.axis_words();
    row->axis_words = {words.x(), words.y(), words.z(), words.a(), words.b()};
  }
  if (!v1::ToolOrientation_IsValid(post.tool_orientation()))
    refusals.Add(runtime::Refuse("tool_orientation", std::to_string(post.tool_orientation()), "one that there is"));
  if (!v1::CommentStyle_IsValid(post.comment_style()))
    refusals.Add(runtime::Refuse("comment_style", std::to_string(post.comment_style()), "one that there is"));
  row->linear_decimals = post.has_linear_decimals() ? post.linear_decimals() : 4;
  row->rotary_decimals = post.has_rotary_decimals() ? post.rotary_decimals() : 4;
  row->direction_decimals = post.has_direction_decimals() ? post.direction_decimals() : 7;
  row->explicit_plus = post.explicit_plus();
  row->directions = post.tool_orientation() == v1::TOOL_ORIENTATION_DIRECTIONS;
  row->semicolon_comments = post.comment_style() == v1::COMMENT_STYLE_SEMICOLON;
  row->leaves_out_repeated = post.leaves_out_repeated();
  row->first_number = post.first_number();
  row->number_step = post.number_step();
  row->program_start = post.program_start();
  row->operation_start = post.operation_start();
  row->hole = post.hole();
  row->path_start = post.path_start();
  row->path_pose = post.path_pose();
  row->path_end = post.path_end();
  row->operation_end = post.operation_end();
  row->program_end = post.program_end();
  refusals.Add(metrology::CheckPostProcessor(KernelOf(*row)));
  return Under("machining_model.post_processor.", refusals.status());
}

v1::PostProcessor ToProto(const storage::PostProcessorRow& row) {
  v1::PostProcessor post;
  if (row.axis_words.size() == 5) {
    v1::AxisWords& words = *post.mutable_axis_words();
    words.set_x(row.axis_words[0]);
    words.set_y(row.axis_words[1]);
    words.set_z(row.axis_words[2]);
    words.set_a(row.axis_words[3]);
    words.set_b(row.axis_words[4]);
  }
  post.set_linear_decimals(row.linear_decimals);
  post.set_rotary_decimals(row.rotary_decimals);
  post.set_direction_decimals(row.direction_decimals);
  post.set_explicit_plus(row.explicit_plus);
  post.set_tool_orientation(row.directions ? v1::TOOL_ORIENTATION_DIRECTIONS : v1::TOOL_ORIENTATION_ROTARY_AXES);
  post.set_comment_style(row.semicolon_comments ? v1::COMMENT_STYLE_SEMICOLON : v1::COMMENT_STYLE_BRACKETS);
  post.set_leaves_out_repeated(row.leaves_out_repeated);
  post.set_first_number(row.first_number);
  post.set_number_step(row.number_step);
  post.set_program_start(row.program_start);
  post.set_operation_start(row.operation_start);
  post.set_hole(row.hole);
  post.set_path_start(row.path_start);
  post.set_path_pose(row.path_pose);
  post.set_path_end(row.path_end);
  post.set_operation_end(row.operation_end);
  post.set_program_end(row.program_end);
  return post;
}

absl::StatusOr<std::string> TemplateOf(const storage::MachiningModelRow& model, const storage::PartRow& part) {
  std::vector<metrology::PostOperation> operations;
  for (const storage::MachiningOperationRow& one : model.operations) {
    metrology::PostOperation& operation = operations.emplace_back();
    operation.operation = one.operation;
    operation.tool_number = one.tool_number;
    operation.feed_mm_min = one.feed_mm_min;
    operation.electrode_diameter_mm = one.electrode_diameter_mm;
    operation.electrode_length_mm = one.electrode_length_mm;
    for (const storage::HoleGroupRow& group : part.hole_groups) {
      if (group.group != one.hole_group) continue;
      for (const storage::HoleRow& hole : group.holes)
        operation.holes.push_back({group.group, hole.hole, group.depth_mm});
    }
    for (const storage::MachiningToolPathRow& path : one.paths)
      operation.paths.push_back({path.path, static_cast<int>(path.tips_in_part_mm.size() / 3)});
  }
  absl::StatusOr<std::string> written =
      metrology::WriteTemplate(KernelOf(*model.post_processor), operations, kMostTemplateBytes);
  if (!written.ok()) return Under("machining_model.post_processor.", written.status());
  return written;
}

metrology::NcFrame FrameOf(const storage::MachiningModelRow& model) {
  metrology::NcFrame frame;
  if (!model.post_processor) return frame;
  frame.axis_words = KernelOf(*model.post_processor).axis_words;
  // Which axes it holds is the machine's; a template is checked for its words alone.
  if (model.post_processor->directions) frame.transformation.emplace();
  return frame;
}

}  // namespace sixpoint::plant
