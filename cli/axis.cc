#include <CLI/CLI.hpp>
#include <iostream>

#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/plant_documents.h"
#include "cli/reports.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using calibration::v1::AxisCharacterisation;
using calibration::v1::CalibrationService;

struct Arguments {
  std::string machine, axis, file;
};

absl::Status CharacteriseAxis(Session* session, const Arguments& arguments) {
  const absl::StatusOr<calibration::v1::AxisRun> run = LoadAxisRun(arguments.file, arguments.axis);
  if (!run.ok()) return run.status();
  calibration::v1::CharacteriseAxisRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  request.set_axis(arguments.axis);
  *request.mutable_run() = *run;
  request.set_requested_by(session->requested_by());
  request.set_request_id(NewRequestId());
  AxisCharacterisation response;
  const absl::Status status =
      session->Call<CalibrationService>("calibration", &CalibrationService::Stub::CharacteriseAxis, request, &response);
  if (!status.ok()) return status;
  if (session->json) {
    PrintJson(MessageToJson(response));
  } else {
    std::cout << AxisText(response);
  }
  return absl::OkStatus();
}

}  // namespace

void AddCalibrateAxisCommand(CLI::App* calibrate, Session* session) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* axis = calibrate->add_subcommand("axis", "How a rotary axis positions, from an encoder run over a turn");
  axis->add_option("--machine", arguments->machine, "The machine")->required();
  axis->add_option("--axis", arguments->axis, "The axis's letter")->required();
  axis->add_option("--run", arguments->file, "Encoder run (YAML or JSON), or a dataset.json")->required();
  session->OnCommand(axis, [session, arguments] { return CharacteriseAxis(session, *arguments); });
}

}  // namespace sixpoint::cli
