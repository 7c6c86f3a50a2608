#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/out_file.h"
#include "cli/output.h"
#include "cli/plant_run/plant_run.h"

namespace sixpoint::cli {

void AddPlantCommands(Command* app, Session* session) {
  Command* plant = app->AddCommand("plant", "A whole plant from files");
  plant->RequireCommand();
  const auto folder = std::make_shared<std::string>();
  const auto out = std::make_shared<std::string>();
  Command* run = plant->AddCommand("run", "Registers, uploads, calibrates, positions, corrects and inspects all of it");
  run->AddOption("DIR", folder.get(), "Folder with dataset.json")->Required();
  AddOutOption(run, out.get(), "Where the results are written (JSON)")->Required();
  session->OnCommand(run, [session, folder, out]() -> absl::Status {
    absl::Status status = CheckOut(*session, *out);
    if (!status.ok()) return status;
    absl::StatusOr<Dataset> dataset = LoadDataset(*folder);
    if (!dataset.ok()) return dataset.status();
    absl::StatusOr<PlantRunResult> result = RunPlant(session, *folder, *dataset);
    if (!result.ok()) return result.status();
    const nlohmann::json json = ResultsToJson(*result);
    status = WriteOut(*out, json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    if (!status.ok()) return status;
    if (session->json) {
      PrintJson(json);
    } else {
      BesideOut(*out) << ResultsToText(*result) << "\nresults written to " << OutText(*out) << "\n";
    }
    if (!result->failures.empty()) session->MarkNotUsable();
    return absl::OkStatus();
  });
}

}  // namespace sixpoint::cli
