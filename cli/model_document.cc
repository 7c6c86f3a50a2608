#include "cli/model_document.h"

#include "cli/document.h"
#include "cli/output.h"

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
  operation.OnlyKeys({"operation", "hole_group", "paths", "electrode"});
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
  root.OnlyKeys({"id", "part", "operations", "w_mm", "work_offsets", "tool_lengths"});
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
  if (!problems.empty()) return problems.ToStatus();
  absl::StatusOr<std::string> nc_template = ReadFile(template_file, kGreatestTemplateBytes);
  if (!nc_template.ok()) return nc_template.status();
  model.set_nc_template(*std::move(nc_template));
  return request;
}

}  // namespace sixpoint::cli
