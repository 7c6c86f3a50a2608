#include <iostream>

#include "cli/commands.h"
#include "cli/model_document.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/table.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::PlantService;

struct ModelArguments {
  std::string file_or_id, template_file;
  bool only_template = false;
};

std::string PathsText(const plant::v1::MachiningOperation& operation) {
  const int count = operation.paths_size();
  return operation.paths(0).path() + (count > 1 ? " and " + std::to_string(count - 1) + " more paths" : ", a path");
}

void PrintModel(const Session& session, const plant::v1::MachiningModel& model) {
  if (session.json) return PrintJson(model);
  std::cout << model.name() << ", revision " << model.revision() << ", " << TimeText(model.created_at()) << "\n"
            << "part     " << IdText(model.part()) << ", revision " << model.part_revision() << "\n"
            << "template " << model.nc_template().size() << " bytes, sha256 " << model.nc_template_sha256() << "\n";
  if (model.has_w_mm()) std::cout << "W        " << Fixed(model.w_mm(), 3) << " mm\n";
  for (const plant::v1::WorkOffset& one : model.work_offsets())
    std::cout << "offset   " << one.code() << " " << Fixed(one.x_mm(), 4) << ", " << Fixed(one.y_mm(), 4) << ", "
              << Fixed(one.z_mm(), 4) << " mm, " << Fixed(one.a_deg(), 4) << ", " << Fixed(one.b_deg(), 4) << " deg\n";
  for (const plant::v1::ToolLength& one : model.tool_lengths())
    std::cout << "tool     " << one.number() << ", " << Fixed(one.length_mm(), 3) << " mm long\n";
  if (model.has_post_processor())
    std::cout << "written  by its post-processor, "
              << (model.post_processor().tool_orientation() == plant::v1::TOOL_ORIENTATION_DIRECTIONS
                      ? "paths by directions (TRAORI) and the record's axes"
                      : "by rotary axes")
              << "; zeros until a correction says the values\n";
  Table table({"operation", "holes", ">electrode mm", ">length mm", ">worn by a hole mm"});
  for (const plant::v1::MachiningOperation& one : model.operations())
    table.AddRow({one.operation(), one.paths().empty() ? one.hole_group() : PathsText(one),
                  Fixed(one.electrode().diameter_mm(), 3), Fixed(one.electrode().length_mm(), 3),
                  Fixed(one.electrode().wear_mm(), 3)});
  std::cout << table.ToText();
  Table paths({"path", ">poses", ">A deg", ">B deg", ">tolerance mm", ">deg", ">mouth mm"});
  bool any = false;
  for (const plant::v1::MachiningOperation& one : model.operations())
    for (const plant::v1::ToolPath& path : one.paths()) {
      any = true;
      paths.AddRow({path.path(), std::to_string(path.poses_size()), Fixed(path.a_nominal_deg(), 4),
                    Fixed(path.b_nominal_deg(), 4), Fixed(path.position_tolerance_mm(), 3),
                    Fixed(path.inclination_tolerance_deg(), 3), Fixed(path.mouth_mm(), 3)});
    }
  if (any) std::cout << "\n" << paths.ToText();
}

absl::Status AddModel(Session* session, const ModelArguments& arguments) {
  absl::StatusOr<plant::v1::CreateMachiningModelRequest> request =
      LoadMachiningModel(arguments.file_or_id, arguments.template_file);
  if (!request.ok()) return request.status();
  request->set_request_id(NewRequestId());
  plant::v1::MachiningModel response;
  absl::Status status =
      session->Call<PlantService>("plant", &PlantService::Stub::CreateMachiningModel, *request, &response);
  if (status.ok()) PrintModel(*session, response);
  return status;
}

absl::Status ShowModel(Session* session, const ModelArguments& arguments) {
  plant::v1::GetMachiningModelRequest request;
  request.set_name(NameText("machining_models", arguments.file_or_id));
  plant::v1::MachiningModel response;
  absl::Status status =
      session->Call<PlantService>("plant", &PlantService::Stub::GetMachiningModel, request, &response);
  if (!status.ok()) return status;
  if (arguments.only_template)
    std::cout << response.nc_template();
  else
    PrintModel(*session, response);
  return status;
}

}  // namespace

void AddModelCommands(Command* app, Session* session) {
  Command* model = app->AddCommand("model", "Machining models: operations, electrodes and the program's template");
  model->RequireCommand();
  const auto arguments = std::make_shared<ModelArguments>();

  Command* add = model->AddCommand("add", "Adds a machining model, or a new revision of it, from a YAML file");
  add->AddOption("FILE", &arguments->file_or_id, "YAML as docs/examples/model.yaml")->Required();
  add->AddOption(
      "--template", &arguments->template_file,
      "NC program of the nominal part, its holes marked; none where FILE has a post_processor, which writes it");
  session->OnCommand(add, [session, arguments] { return AddModel(session, *arguments); });

  plant::v1::ListMachiningModelsRequest whole;  // operations are counted
  whole.set_view(list::v1::VIEW_FULL);
  AddListCommand<PlantService>(
      model, session, "Lists the machining models", "plant", &PlantService::Stub::ListMachiningModels, whole,
      Table({"model", ">revision", "part", ">operations", "since"}),
      &plant::v1::ListMachiningModelsResponse::machining_models, [](const plant::v1::MachiningModel& entry) {
        return Cells{IdText(entry.name()), std::to_string(entry.revision()), IdText(entry.part()),
                     std::to_string(entry.operations_size()), TimeText(entry.created_at())};
      });

  Command* show = model->AddCommand("show", "Shows a machining model");
  show->AddOption("ID", &arguments->file_or_id, "The machining model, or one of its revisions: ID@REVISION")
      ->Required();
  show->AddFlag("--only-template", &arguments->only_template, "Prints the template alone");
  session->OnCommand(show, [session, arguments] { return ShowModel(session, *arguments); });
}

}  // namespace sixpoint::cli
