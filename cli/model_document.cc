#include "cli/model_document.h"

#include "cli/document.h"
#include "cli/output.h"
#include "refusal/refusal.h"

namespace sixpoint::cli {
namespace {

constexpr double kGreatestOffset = 1e5;  // mm, deg
constexpr std::uint64_t kGreatestTemplateBytes = 1u << 20;

// [x, y, z, i, j, k]: the tip, and the way from it to the holder.
void ReadPose(const Field& pose, plant::v1::ToolPose* out) {
  const std::vector<Field> values = pose.Items(6, 6);
  if (values.size() != 6) return;
  out->mutable_tip_in_part_mm()->set_x_mm(values[0].Number());
  out->mutable_tip_in_part_mm()->set_y_mm(values[1].Number());
  out->mutable_tip_in_part_mm()->set_z_mm(values[2].Number());
  // Of any length: what CAM systems write has few decimals.
  const Eigen::Vector3d axis(values[3].Number(), values[4].Number(), values[5].Number());
  const double length = axis.norm();
  if (!(length > 0)) return pose.Refuse("a direction behind the tip's place");
  out->mutable_axis_in_part()->set_x(axis.x() / length);
  out->mutable_axis_in_part()->set_y(axis.y() / length);
  out->mutable_axis_in_part()->set_z(axis.z() / length);
}

void ReadPath(const Field& path, plant::v1::ToolPath* out) {
  path.OnlyKeys({"path", "a_nominal_deg", "b_nominal_deg", "position_tolerance_mm", "inclination_tolerance_deg",
                 "mouth_mm", "greatest_step_deg", "poses"});
  out->set_path(path.At("path").Id());
  out->set_a_nominal_deg(path.At("a_nominal_deg").Number());
  out->set_b_nominal_deg(path.At("b_nominal_deg").Number());
  out->set_position_tolerance_mm(path.At("position_tolerance_mm").Positive());
  out->set_inclination_tolerance_deg(path.At("inclination_tolerance_deg").Positive());
  out->set_mouth_mm(path.At("mouth_mm").Positive());
  if (const auto step = path.Find("greatest_step_deg")) out->set_greatest_step_deg(step->Positive());
  for (const Field& pose : path.At("poses").Items(2, 5000)) ReadPose(pose, out->add_poses());
}

void ReadOperation(const Field& operation, plant::v1::MachiningOperation* out) {
  operation.OnlyKeys({"operation", "hole_group", "paths", "electrode", "tool_number", "feed_mm_min"});
  out->set_operation(operation.At("operation").Id());
  if (const auto paths = operation.Find("paths")) {
    for (const Field& path : paths->Items(1, 1000)) ReadPath(path, out->add_paths());
    if (const auto group = operation.Find("hole_group")) out->set_hole_group(group->Text());  // one of both is refused
  } else {
    out->set_hole_group(operation.At("hole_group").Text());
  }
  const Field electrode = operation.At("electrode");
  electrode.OnlyKeys({"diameter_mm", "length_mm", "wear_mm"});
  out->mutable_electrode()->set_diameter_mm(electrode.At("diameter_mm").Positive());
  out->mutable_electrode()->set_length_mm(electrode.At("length_mm").Positive());
  if (const auto wear = electrode.Find("wear_mm")) out->mutable_electrode()->set_wear_mm(wear->Number(0));
  if (const auto tool = operation.Find("tool_number")) out->set_tool_number(static_cast<int>(tool->Whole(1, 9999)));
  if (const auto feed = operation.Find("feed_mm_min")) out->set_feed_mm_min(feed->Positive());
}

void ReadStyle(const Field& post, plant::v1::PostProcessor* out) {
  if (const auto words = post.Find("axis_words")) {
    words->OnlyKeys({"x", "y", "z", "a", "b"});
    plant::v1::AxisWords& to = *out->mutable_axis_words();
    to.set_x(words->At("x").Text());
    to.set_y(words->At("y").Text());
    to.set_z(words->At("z").Text());
    to.set_a(words->At("a").Text());
    to.set_b(words->At("b").Text());
  }
  if (const auto decimals = post.Find("decimals")) {
    decimals->OnlyKeys({"linear", "rotary", "direction"});
    if (const auto one = decimals->Find("linear")) out->set_linear_decimals(static_cast<int>(one->Whole(4, 9)));
    if (const auto one = decimals->Find("rotary")) out->set_rotary_decimals(static_cast<int>(one->Whole(4, 9)));
    if (const auto one = decimals->Find("direction")) out->set_direction_decimals(static_cast<int>(one->Whole(6, 9)));
  }
  if (const auto numbers = post.Find("block_numbers")) {
    numbers->OnlyKeys({"first", "step"});
    out->set_first_number(static_cast<int>(numbers->At("first").Whole(0, 1'000'000)));
    out->set_number_step(static_cast<int>(numbers->At("step").Whole(1, 1000)));
  }
  if (const auto plus = post.Find("explicit_plus")) out->set_explicit_plus(plus->Flag());
  if (const auto leaves = post.Find("leaves_out_repeated")) out->set_leaves_out_repeated(leaves->Flag());
  if (const auto orientation = post.Find("tool_orientation"))
    out->set_tool_orientation(orientation->Choice({"rotary_axes", "directions"}) == "rotary_axes"
                                  ? plant::v1::TOOL_ORIENTATION_ROTARY_AXES
                                  : plant::v1::TOOL_ORIENTATION_DIRECTIONS);
  if (const auto comments = post.Find("comments"))
    out->set_comment_style(comments->Choice({"brackets", "semicolon"}) == "brackets"
                               ? plant::v1::COMMENT_STYLE_BRACKETS
                               : plant::v1::COMMENT_STYLE_SEMICOLON);
}

void ReadPostProcessor(const Field& post, plant::v1::PostProcessor* out) {
  post.OnlyKeys({"axis_words", "decimals", "block_numbers", "explicit_plus", "leaves_out_repeated", "tool_orientation",
                 "comments", "program_start", "operation_start", "hole", "path_start", "path_pose", "path_end",
                 "operation_end", "program_end"});
  ReadStyle(post, out);
  const auto text = [&](const char* key) {
    const auto field = post.Find(key);
    return field ? field->Lines(8192) : std::string();
  };
  out->set_program_start(text("program_start"));
  out->set_operation_start(text("operation_start"));
  out->set_hole(text("hole"));
  out->set_path_start(text("path_start"));
  out->set_path_pose(text("path_pose"));
  out->set_path_end(text("path_end"));
  out->set_operation_end(text("operation_end"));
  out->set_program_end(text("program_end"));
}

void ReadOffset(const Field& offset, plant::v1::WorkOffset* out) {
  offset.OnlyKeys({"code", "x_mm", "y_mm", "z_mm", "a_deg", "b_deg"});
  out->set_code(offset.At("code").Text());
  const auto value = [&](const char* key) {
    const auto field = offset.Find(key);
    return field ? field->Number(-kGreatestOffset, kGreatestOffset) : 0;
  };
  out->set_x_mm(value("x_mm"));
  out->set_y_mm(value("y_mm"));
  out->set_z_mm(value("z_mm"));
  out->set_a_deg(value("a_deg"));
  out->set_b_deg(value("b_deg"));
}

}  // namespace

absl::StatusOr<plant::v1::CreateMachiningModelRequest> LoadMachiningModel(const std::string& path,
                                                                          const std::string& template_file) {
  absl::StatusOr<nlohmann::json> document = LoadDocument(path);
  if (!document.ok()) return document.status();
  Problems problems(true);
  const Field root(&*document, "", &problems);
  root.OnlyKeys({"id", "part", "operations", "w_mm", "work_offsets", "tool_lengths", "post_processor"});
  plant::v1::CreateMachiningModelRequest request;
  request.set_machining_model_id(root.At("id").Id());
  plant::v1::MachiningModel& model = *request.mutable_machining_model();
  model.set_part(NameText("parts", root.At("part").Text()));
  for (const Field& operation : root.At("operations").Items(1, 1000)) ReadOperation(operation, model.add_operations());
  if (const auto w = root.Find("w_mm")) model.set_w_mm(w->Number());
  if (const auto offsets = root.Find("work_offsets"))
    for (const Field& offset : offsets->Items(1, 6)) ReadOffset(offset, model.add_work_offsets());
  if (const auto tools = root.Find("tool_lengths"))
    for (const Field& tool : tools->Items(1, 100)) {
      tool.OnlyKeys({"number", "length_mm"});
      plant::v1::ToolLength& out = *model.add_tool_lengths();
      out.set_number(static_cast<int>(tool.At("number").Whole(1, 9999)));
      out.set_length_mm(tool.At("length_mm").Number(0));
    }
  const auto post = root.Find("post_processor");
  if (post) ReadPostProcessor(*post, model.mutable_post_processor());
  if (!problems.empty()) return problems.ToStatus();
  if (post.has_value() != template_file.empty())
    return sixpoint::Refuse(
        "--template", template_file,
        post ? "none beside a post_processor in " + path : "a file, or a post_processor in " + path);
  if (post) return request;
  absl::StatusOr<std::string> nc_template = ReadFile(template_file, kGreatestTemplateBytes);
  if (!nc_template.ok()) return nc_template.status();
  model.set_nc_template(*std::move(nc_template));
  return request;
}

}  // namespace sixpoint::cli
