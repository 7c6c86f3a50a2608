#include <algorithm>

#include "cli/commands.h"
#include "cli/register_options.h"
#include "cli/reports.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"

namespace sixpoint::cli {

using inspection::v1::InspectionService;

void AddInspectCommand(Command* app, Session* session) {
  struct Arguments {
    std::string blade, method, sensor_calibration;
    std::vector<std::string> scans;
    bool axis_tables = false;
    RegisterOptions options;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* command = app->AddCommand("inspect", "Judges a machined blade; done means judged, whatever the verdict");
  command->AddOption("--blade", &arguments->blade, "Serial number")->Required();
  command->AddOption("--scans", &arguments->scans, "Scans with a pin in each hole: ID,ID,...")->Required()->List();
  std::vector<std::string> methods = RegisterMethods();
  methods.erase(std::remove(methods.begin(), methods.end(), "allowance"), methods.end());
  command
      ->AddOption("--method", &arguments->method,
                  "How the part is positioned: six-point (without it), six-point-normals, best-fit or local")
      ->OneOf(methods);
  command->AddFlag("--axis-tables", &arguments->axis_tables,
                   "Take the scans where the axes' characterisations say they were; not where the control compensates");
  command->AddOption("--sensor-calibration", &arguments->sensor_calibration,
                     "Maps the scans by it; without it by the one that was in force when they were received");
  AddFitOptions(command, &arguments->options);
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    inspection::v1::InspectRequest request;
    request.set_blade(NameText("blades", arguments->blade));
    for (const std::string& scan : arguments->scans) request.add_scans(NameText("scans", scan));
    request.set_method(RegisterMethodOf(arguments->method));
    auto options = FitOptionsOf(arguments->options);
    if (!options.ok()) return options.status();
    if (options->ByteSizeLong() > 0) *request.mutable_options() = *std::move(options);
    request.set_apply_axis_tables(arguments->axis_tables);
    if (!arguments->sensor_calibration.empty())
      request.set_sensor_calibration(NameText("calibrations", arguments->sensor_calibration));
    request.set_request_id(NewRequestId());
    return CallAndPrint<InspectionService>(session, "inspection", &InspectionService::Stub::Inspect, request,
                                           InspectionText, "inspecting " + arguments->blade)
        .status();
  });
}

}  // namespace sixpoint::cli
