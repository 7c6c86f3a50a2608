
#include "cli/calibration_documents.h"
#include "cli/calibration_options.h"
#include "cli/commands.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using calibration::v1::CalibrationService;

struct AxisArguments : CalibrationOptions {
  std::string machine, axis, file;
};

absl::Status CharacteriseAxis(Session* session, const AxisArguments& arguments) {
  const absl::StatusOr<calibration::v1::AxisRun> run = LoadAxisRun(arguments.file, arguments.axis);
  if (!run.ok()) return run.status();
  calibration::v1::CharacteriseAxisRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  request.set_axis(arguments.axis);
  *request.mutable_run() = *run;
  SetCalibrationOptions(arguments, &request);
  return CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::CharacteriseAxis, request,
                                          CalibrationText, "characterising axis " + arguments.axis)
      .status();
}

}  // namespace

void AddCalibrateAxisCommand(Command* calibrate, Session* session) {
  const auto arguments = std::make_shared<AxisArguments>();
  Command* axis = calibrate->AddCommand("axis", "How a rotary axis positions, from an encoder run over a turn");
  axis->AddOption("--machine", &arguments->machine, "The machine")->Required();
  axis->AddOption("--axis", &arguments->axis, "The axis's letter")->Required();
  axis->AddOption("--run", &arguments->file, "Encoder run (YAML or JSON), or a dataset.json")->Required();
  AddCalibrationOptions(axis, arguments);
  session->OnCommand(axis, [session, arguments] { return CharacteriseAxis(session, *arguments); });
}

}  // namespace sixpoint::cli
