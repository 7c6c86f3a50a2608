#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "cli/commands.h"
#include "cli/document.h"
#include "cli/output.h"
#include "cli/plant_run/plant_run.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {

void AddPlantCommands(CLI::App* app, Session* session) {
  CLI::App* plant = app->add_subcommand("plant", "A whole plant from files");
  plant->require_subcommand(1);
  const auto folder = std::make_shared<std::string>();
  const auto results = std::make_shared<std::string>();
  CLI::App* run =
      plant->add_subcommand("run", "Registers, uploads, calibrates, positions, corrects and inspects all of it");
  run->add_option("DIR", *folder, "Folder with dataset.json")->required();
  run->add_option("--results", *results, "Where the results are written (JSON)")->required();
  session->OnCommand(run, [session, folder, results]() -> absl::Status {
    // Found now rather than after minutes of work.
    const std::filesystem::path results_folder = std::filesystem::absolute(*results).parent_path();
    if (!std::filesystem::is_directory(results_folder)) {
      return runtime::Refuse("--results", *results, "a file in a folder that exists");
    }
    absl::StatusOr<Dataset> dataset = LoadDataset(*folder);
    if (!dataset.ok()) return dataset.status();
    absl::StatusOr<PlantRunResult> result = RunPlant(session, *folder, *dataset);
    if (!result.ok()) return result.status();
    const nlohmann::json json = ResultsToJson(*result);
    absl::Status status =
        WriteFile(*results, json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    if (!status.ok()) return status;
    if (session->json) {
      PrintJson(json);
    } else {
      std::cout << ResultsToText(*result) << "\nresults written to " << *results << "\n";
    }
    if (!result->failures.empty()) session->MarkNotUsable();
    return absl::OkStatus();
  });
}

}  // namespace sixpoint::cli
