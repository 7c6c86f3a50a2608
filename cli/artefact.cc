#include <iostream>

#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/plant_documents.h"
#include "cli/table.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::PlantService;

void PrintArtefact(const Session& session, const plant::v1::Artefact& artefact) {
  if (session.json) return PrintJson(artefact);
  std::cout << artefact.name() << ", revision " << artefact.revision() << ", " << TimeText(artefact.created_at())
            << "\n"
            << "plate  " << Fixed(artefact.side_mm(), 3) << " mm square\n"
            << "cones  half angle " << Fixed(artefact.cone_half_angle_deg(), 3) << " deg, radius "
            << Fixed(artefact.cone_top_radius_mm(), 3) << " to " << Fixed(artefact.cone_bottom_radius_mm(), 3)
            << " mm\n"
            << "slots  " << Fixed(artefact.slot_width_mm(), 3) << " mm wide, " << Fixed(artefact.slot_depth_mm(), 3)
            << " mm deep\n";
  if (!artefact.serial_number().empty()) std::cout << "serial " << artefact.serial_number() << "\n";
  if (artefact.has_certificate())
    std::cout << "certificate " << artefact.certificate().number() << ", from "
              << TimeText(artefact.certificate().calibrated_at()) << " until "
              << TimeText(artefact.certificate().expires_at()) << "\n";
  if (artefact.has_centre_standard_uncertainty_um())
    std::cout << "centres, touched against scanned, " << Fixed(artefact.centre_standard_uncertainty_um(), 2)
              << " um (k = 1)\n";
  if (artefact.has_flatness_standard_uncertainty_um())
    std::cout << "upper face flat to " << Fixed(artefact.flatness_standard_uncertainty_um(), 2) << " um (k = 1)\n";
  Table table({"feature", ">x mm", ">y mm"});
  for (const auto* features : {&artefact.cones(), &artefact.slots()}) {
    for (const auto& feature : *features) {
      table.AddRow({feature.feature(), Fixed(feature.x_mm(), 4), Fixed(feature.y_mm(), 4)});
    }
  }
  std::cout << table.ToText();
}

}  // namespace

void AddArtefactCommands(Command* app, Session* session) {
  Command* artefact = app->AddCommand("artefact", "Calibration artefacts");
  artefact->RequireCommand();
  const auto argument = std::make_shared<std::string>();

  Command* add = artefact->AddCommand("add", "Adds an artefact, or a new revision of it, from a YAML file");
  add->AddOption("FILE", argument.get(), "YAML as docs/examples/artefact.yaml")->Required();
  session->OnCommand(add, [session, argument]() -> absl::Status {
    absl::StatusOr<plant::v1::CreateArtefactRequest> request = LoadArtefact(*argument);
    if (!request.ok()) return request.status();
    request->set_request_id(NewRequestId());
    plant::v1::Artefact response;
    absl::Status status =
        session->Call<PlantService>("plant", &PlantService::Stub::CreateArtefact, *request, &response);
    if (status.ok()) PrintArtefact(*session, response);
    return status;
  });

  plant::v1::ListArtefactsRequest whole;  // cones and slots are counted
  whole.set_view(list::v1::VIEW_FULL);
  AddListCommand<PlantService>(artefact, session, "Lists the artefacts", "plant", &PlantService::Stub::ListArtefacts,
                               whole, Table({"artefact", ">revision", ">side mm", ">cones", ">slots", "since"}),
                               &plant::v1::ListArtefactsResponse::artefacts, [](const plant::v1::Artefact& entry) {
                                 return Cells{IdText(entry.name()),
                                              std::to_string(entry.revision()),
                                              Fixed(entry.side_mm(), 3),
                                              std::to_string(entry.cones_size()),
                                              std::to_string(entry.slots_size()),
                                              TimeText(entry.created_at())};
                               });

  Command* show = artefact->AddCommand("show", "Shows an artefact");
  show->AddOption("ID", argument.get(), "The artefact")->Required();
  session->OnCommand(show, [session, argument]() -> absl::Status {
    plant::v1::GetArtefactRequest request;
    request.set_name(NameText("artefacts", *argument));
    plant::v1::Artefact response;
    absl::Status status = session->Call<PlantService>("plant", &PlantService::Stub::GetArtefact, request, &response);
    if (status.ok()) PrintArtefact(*session, response);
    return status;
  });
}

}  // namespace sixpoint::cli
