#include <CLI/CLI.hpp>
#include <iostream>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"

namespace sixpoint::cli {

using inspection::v1::InspectionService;

void AddInspectCommand(CLI::App* app, Session* session) {
  const auto blade = std::make_shared<std::string>();
  const auto scans = std::make_shared<std::vector<std::string>>();
  CLI::App* command =
      app->add_subcommand("inspect", "Judges a machined blade; done means judged, whatever the verdict");
  command->add_option("--blade", *blade, "Serial number")->required();
  command->add_option("--scans", *scans, "Scans with a pin in each hole: ID,ID,...")
      ->required()
      ->delimiter(',')
      ->allow_extra_args(false);
  const auto axis_tables = std::make_shared<bool>(false);
  command->add_flag(
      "--axis-tables", *axis_tables,
      "Take the scans where the axes' characterisations say they were; not where the control compensates");
  session->OnCommand(command, [session, blade, scans, axis_tables]() -> absl::Status {
    inspection::v1::InspectRequest request;
    request.set_blade(NameText("blades", *blade));
    for (const std::string& scan : *scans) request.add_scans(NameText("scans", scan));
    request.set_apply_axis_tables(*axis_tables);
    request.set_requested_by(session->requested_by());
    request.set_request_id(NewRequestId());
    inspection::v1::Inspection response;
    absl::Status status =
        session->Call<InspectionService>("inspection", &InspectionService::Stub::Inspect, request, &response);
    if (!status.ok()) return status;
    if (session->json) {
      PrintJson(MessageToJson(response));
    } else {
      std::cout << InspectionText(response);
    }
    return status;
  });
}

}  // namespace sixpoint::cli
