#include "cli/app.h"

#include "cli/commands.h"
#include "services/runtime/server.h"

namespace sixpoint::cli {
namespace {

void AddGlobalOptions(CLI::App* app, Session* session) {
  app->set_version_flag("--version", runtime::SoftwareVersion());
  app->add_option("--server", session->server, "The plant service, HOST:PORT")
      ->envname("SIXPOINT_SERVER")
      ->capture_default_str();
  app->add_option("--deadline-s", session->deadline_s, "Longest time for one call")
      ->check(CLI::Range(0.1, 86400.0))
      ->capture_default_str();
  app->add_flag("--json", session->json, "Results on stdout as JSON, for programs");
  app->add_option("--config", session->config_file, "What holds where no option is given (YAML)")
      ->capture_default_str();
}

}  // namespace

void AddCommands(CLI::App* app, Session* session) {
  app->name("sixpoint");
  app->description("Sixpoint: adaptive machining of turbine blades.");
  app->require_subcommand(1);
  app->fallthrough();
  AddGlobalOptions(app, session);
  AddLocalPlantCommands(app, session);
  AddMachineCommands(app, session);
  AddArtefactCommands(app, session);
  AddPartCommands(app, session);
  AddBladeCommands(app, session);
  AddScanCommands(app, session);
  AddStoreCommands(app, session);
  AddCalibrateCommands(app, session);
  AddCalibrationCommands(app, session);
  AddStudyCommands(app, session);
  AddRegisterCommand(app, session);
  AddRegistrationCommands(app, session);
  AddCorrectCommand(app, session);
  AddCorrectionCommands(app, session);
  AddInspectCommand(app, session);
  AddInspectionCommands(app, session);
  AddRecallCommand(app, session);
  AddPlantCommands(app, session);
  AddCallCommand(app, session);
  AddCompletionCommand(app, session);
  DescribeCommands(app);
}

}  // namespace sixpoint::cli
