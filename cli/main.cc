// `sixpoint`, the engineer's tool: wiring only.
#include <CLI/CLI.hpp>
#include <iostream>

#include "cli/commands.h"
#include "cli/local_plant.h"
#include "services/runtime/server.h"

int main(int argc, char** argv) {
  using namespace sixpoint::cli;
  Session session;
  CLI::App app(
      "Sixpoint: adaptive machining of turbine blades.\n"
      "Exit code 0: done; 1: refused or failed; 2: wrong usage; 3: no plant answers; 4: answered, but the result "
      "must not be used.");
  app.name("sixpoint");
  app.require_subcommand(1);
  app.fallthrough();
  app.set_version_flag("--version", sixpoint::runtime::SoftwareVersion());
  app.add_option("--server", session.server, "The plant service, HOST:PORT")
      ->envname("SIXPOINT_SERVER")
      ->capture_default_str();
  app.add_option("--deadline-s", session.deadline_s, "Longest time for one call")
      ->check(CLI::Range(0.1, 86400.0))
      ->capture_default_str();
  app.add_flag("--json", session.json, "Results on stdout as JSON, for programs");
  AddLocalPlantCommands(app);
  AddMachineCommands(&app, &session);
  AddArtefactCommands(&app, &session);
  AddPartCommands(&app, &session);
  AddBladeCommands(&app, &session);
  AddScanCommands(&app, &session);
  AddStoreCommands(&app, &session);
  AddCalibrateCommands(&app, &session);
  AddCalibrationCommands(&app, &session);
  AddRegisterCommand(&app, &session);
  AddCorrectCommand(&app, &session);
  AddInspectCommand(&app, &session);
  AddTraceCommand(&app, &session);
  AddPlantCommands(&app, &session);
  AddStudyCommands(&app, &session);
  AddCallCommand(&app, &session);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version are no failures; all else is wrong usage.
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  return session.has_action() ? session.Run() : kDone;
}
