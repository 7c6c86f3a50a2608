#include <CLI/CLI.hpp>
#include <iostream>

#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "cli/table.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"

namespace sixpoint::cli {

using calibration::v1::CalibrationService;

void AddCalibrationCommands(CLI::App* app, Session* session) {
  CLI::App* calibration = app->add_subcommand("calibration", "Calibrations that were made");
  calibration->require_subcommand(1);
  const auto argument = std::make_shared<std::string>();

  CLI::App* list = calibration->add_subcommand("list", "Lists calibrations");
  list->add_option("--machine", *argument, "Only of this machine");
  session->OnCommand(list, [session, argument]() -> absl::Status {
    calibration::v1::ListCalibrationsRequest request;
    if (!argument->empty()) request.set_machine(NameText("machines", *argument));
    nlohmann::json json = nlohmann::json::array();
    Table table({"calibration", "kind", "machine", "method", ">rms um", "valid from", "valid until"});
    absl::Status status = ForEachPage<CalibrationService>(
        session, "calibration", &CalibrationService::Stub::ListCalibrations, request,
        [&](const calibration::v1::ListCalibrationsResponse& page) {
          for (const calibration::v1::Calibration& entry : page.calibrations()) {
            json.push_back(MessageToJson(entry));
            const double rms_um = entry.has_sensor()  ? entry.sensor().residual_rms_um()
                                  : entry.has_probe() ? entry.probe().residual_rms_um()
                                                      : entry.rotation().residual_rms_um();
            table.AddRow({IdText(entry.name()), EnumText(CalibrationKind_Name(entry.kind()), "CALIBRATION_KIND_"),
                          IdText(entry.machine()), entry.method(), Fixed(rms_um, 3), TimeText(entry.valid_from()),
                          TimeText(entry.valid_until())});
          }
        });
    if (!status.ok()) return status;
    PrintList(session->json, json, table);
    return status;
  });

  CLI::App* show = calibration->add_subcommand("show", "Shows a calibration with its uncertainties");
  show->add_option("ID", *argument, "The calibration")->required();
  session->OnCommand(show, [session, argument]() -> absl::Status {
    calibration::v1::GetCalibrationRequest request;
    request.set_name(NameText("calibrations", *argument));
    calibration::v1::Calibration response;
    absl::Status status =
        session->Call<CalibrationService>("calibration", &CalibrationService::Stub::GetCalibration, request, &response);
    if (!status.ok()) return status;
    if (session->json) {
      PrintJson(MessageToJson(response));
    } else {
      std::cout << CalibrationText(response);
    }
    return status;
  });
}

}  // namespace sixpoint::cli
