
#include "cli/calibrate_probe.h"
#include "cli/calibration_documents.h"
#include "cli/calibration_options.h"
#include "cli/commands.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "cli/rotary_letters.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using calibration::v1::CalibrationService;

// One that its own residuals made a draft must not be used before a person looked at it.
absl::Status MarkHeld(Session* session, const absl::StatusOr<calibration::v1::Calibration>& made) {
  if (!made.ok()) return made.status();
  for (const calibration::v1::ResidualJudgement& judged : made->judgements())
    if (!judged.agrees()) session->MarkNotUsable();
  return absl::OkStatus();
}

struct CalibrateArguments : CalibrationOptions {
  std::string machine, artefact, file;
  std::vector<std::string> scans;
  std::string method;
  std::string gauge_file;
  bool axis_tables = false;
  double uncertainty_um = 0;
};

absl::Status OrderSensorCalibration(Session* session, const CalibrateArguments& arguments) {
  absl::StatusOr<calibration::v1::TouchData> touch = LoadTouchData(arguments.file);
  if (!touch.ok()) return touch.status();
  calibration::v1::CalibrateSensorRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  request.set_artefact(NameText("artefacts", arguments.artefact));
  for (const std::string& scan : arguments.scans) request.add_scans(NameText("scans", scan));
  *request.mutable_touch() = *touch;
  request.set_method(arguments.method == "sequential" ? calibration::v1::SENSOR_METHOD_SEQUENTIAL
                                                      : calibration::v1::SENSOR_METHOD_JOINT);
  SetCalibrationOptions(arguments, &request);
  return MarkHeld(session,
                  CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::CalibrateSensor,
                                                   request, CalibrationText, "calibrating the sensor"));
}

absl::Status OrderRotationCalibration(Session* session, const CalibrateArguments& arguments) {
  calibration::v1::CalibrateRotationRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  const bool standard = arguments.method == "standard";
  if (standard == arguments.gauge_file.empty())
    return absl::InvalidArgumentError("--gauge: want it with --method standard, and only there");
  if (!arguments.file.empty() || !standard) {
    const absl::StatusOr<plant::v1::Machine> machine = FetchMachine(session, request.machine());
    if (!machine.ok()) return machine.status();
    // With another number of axes than two the service says what it wants of the machine.
    const std::vector<std::string> letters = RotaryLetters(*machine);
    const AxisPair axes = letters.size() == 2 ? AxisPair{letters[0], letters[1]} : AxisPair{"A", "B"};
    absl::StatusOr<std::vector<calibration::v1::SpherePose>> poses = LoadSpherePoses(arguments.file, axes);
    if (!poses.ok()) return poses.status();
    for (const calibration::v1::SpherePose& pose : *poses) *request.add_poses() = pose;
  }
  if (standard) {
    absl::StatusOr<calibration::v1::StandardProbing> probing = LoadStandardProbing(arguments.gauge_file);
    if (!probing.ok()) return probing.status();
    *request.mutable_standard() = *std::move(probing);
  }
  request.set_apply_axis_tables(arguments.axis_tables);
  request.set_standard_uncertainty_um(arguments.uncertainty_um);
  request.set_method(standard                        ? calibration::v1::ROTATION_METHOD_STANDARD
                     : arguments.method == "point-c" ? calibration::v1::ROTATION_METHOD_POINT_C
                                                     : calibration::v1::ROTATION_METHOD_LINES);
  SetCalibrationOptions(arguments, &request);
  return MarkHeld(session,
                  CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::CalibrateRotation,
                                                   request, CalibrationText, "calibrating the rotary axes"));
}

}  // namespace

void AddCalibrateCommands(Command* app, Session* session) {
  Command* calibrate = app->AddCommand("calibrate", "Calibrates a machine");
  calibrate->RequireCommand();

  const auto sensor_arguments = std::make_shared<CalibrateArguments>();
  Command* sensor =
      calibrate->AddCommand("sensor", "Sensor to machine, from artefact scans at two heights and touch data");
  sensor->AddOption("--machine", &sensor_arguments->machine, "The machine")->Required();
  sensor->AddOption("--artefact", &sensor_arguments->artefact, "The artefact that was scanned")->Required();
  sensor->AddOption("--scans", &sensor_arguments->scans, "Its scans: ID,ID,...")->Required()->List();
  sensor->AddOption("--touch", &sensor_arguments->file, "Touch data (YAML or JSON), or a dataset.json")->Required();
  sensor->AddOption("--method", &sensor_arguments->method, "joint (the default) or sequential")
      ->OneOf({"joint", "sequential"});
  AddCalibrationOptions(sensor, sensor_arguments);
  session->OnCommand(sensor,
                     [session, sensor_arguments] { return OrderSensorCalibration(session, *sensor_arguments); });

  const auto rotation_arguments = std::make_shared<CalibrateArguments>();
  Command* rotation = calibrate->AddCommand("rotation", "Rotary axes, from poses of a probed sphere");
  rotation->AddOption("--machine", &rotation_arguments->machine, "The machine")->Required();
  rotation->AddOption("--poses", &rotation_arguments->file,
                      "Sphere poses (YAML or JSON), by the machine's own axes, or a dataset.json");
  rotation->AddOption("--method", &rotation_arguments->method, "lines (the default), point-c or standard")
      ->OneOf({"lines", "point-c", "standard"});
  rotation->AddOption("--gauge", &rotation_arguments->gauge_file,
                      "Method standard: points of its bore and face (YAML or JSON); poses then only check");
  rotation->AddFlag("--axis-tables", &rotation_arguments->axis_tables,
                    "Take the axes where their characterisations say they stood; not where the control compensates");
  rotation->AddOption("--standard-uncertainty-um", &rotation_arguments->uncertainty_um,
                      "Of one probed coordinate; without it, estimated from the residuals");
  AddCalibrationOptions(rotation, rotation_arguments);
  session->OnCommand(rotation,
                     [session, rotation_arguments] { return OrderRotationCalibration(session, *rotation_arguments); });
  AddCalibrateStatedCommand(calibrate, session);
  AddCalibrateProbeCommand(calibrate, session);
  AddCalibrateAxisCommand(calibrate, session);
  AddCalibrateStudyCommands(calibrate, session);
}

}  // namespace sixpoint::cli
