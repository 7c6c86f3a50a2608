#include "cli/app.h"

#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "cli/local_plant.h"
#include "services/runtime/server.h"

namespace sixpoint::cli {
namespace {

void AddGlobalOptions(Command* root, Session* session) {
  root->app()->set_version_flag("--version", runtime::SoftwareVersion());
  root->AddOption("--server", &session->server, "The plant service, HOST:PORT")
      ->FromEnvironment("SIXPOINT_SERVER")
      ->ShowDefault();
  root->AddOption(
          "--identity", &session->identity,
          "Folder of the certificate that is shown to the plant; without it that of `sixpoint up` in --data, or "
          "~/.config/sixpoint/identity")
      ->FromEnvironment("SIXPOINT_IDENTITY");
  if (session->data.empty()) session->data = UsualDataFolder().string();
  root->AddOption("--data", &session->data, "Folder of this computer's own plant")->ShowDefault();
  root->AddOption("--deadline-s", &session->deadline_s, "Longest time for one call")
      ->Within(0.1, 86400.0)
      ->ShowDefault();
  root->AddFlag("--json", &session->json, "Results on stdout as JSON, for programs");
  root->AddOption("--config", &session->config_file, "What holds where no option is given (YAML)")->ShowDefault();
}

}  // namespace

void AddCommands(Command* root, Session* session) {
  root->app()->name("sixpoint");
  root->app()->description("Sixpoint: adaptive machining of turbine blades.");
  root->app()->fallthrough();
  root->RequireCommand();
  AddGlobalOptions(root, session);
  AddLocalPlantCommands(root, session);
  AddSeedCommand(root, session);
  AddLogsCommand(root, session);
  AddDoctorCommand(root, session);
  AddCertsCommands(root, session);
  AddAccountsCommands(root, session);
  AddPersonCommands(root, session);
  AddClearanceCommands(root, session);
  AddMachineCommands(root, session);
  AddArtefactCommands(root, session);
  AddPartCommands(root, session);
  AddDrawingCommands(root, session);
  AddModelCommands(root, session);
  AddBladeCommands(root, session);
  AddScanCommands(root, session);
  AddStoreCommands(root, session);
  AddStorageCommands(root, session);
  AddCalibrateCommands(root, session);
  AddCalibrationCommands(root, session);
  AddStudyCommands(root, session);
  AddPlanCommand(root, session);
  AddRegisterCommand(root, session);
  AddRegistrationCommands(root, session);
  AddCorrectCommand(root, session);
  AddCorrectionCommands(root, session);
  AddInspectCommand(root, session);
  AddInspectionCommands(root, session);
  AddDeviationCommands(root, session);
  AddReconstructionCommands(root, session);
  AddMachiningPassCommands(root, session);
  AddRepairCommands(root, session);
  AddSectionCommands(root, session);
  AddAssessCommand(root, session);
  AddAssessmentCommands(root, session);
  AddMeasurementCommands(root, session);
  AddExportCommand(root, session);
  AddReportCommands(root, session);
  AddFleetCommands(root, session);
  AddOpenCommand(root, session);
  AddRecallCommand(root, session);
  AddTraceCommand(root, session);
  AddEventsCommand(root, session);
  AddWebhookCommands(root, session);
  AddReplayCommand(root, session);
  AddRejudgeCommand(root, session);
  AddValuesCommand(root, session);
  AddEfficacyCommand(root, session);
  AddLedgerCommands(root, session);
  AddPlantCommands(root, session);
  AddCallCommand(root, session);
  AddCompletionCommand(root, session);
  DescribeCommands(root->app());
}

}  // namespace sixpoint::cli
