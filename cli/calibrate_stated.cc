// How a snapshot sensor stands, as a certificate has it.
#include <chrono>
#include <cmath>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "metrology/frames/pose.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/units.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using calibration::v1::CalibrationService;

struct StatedArguments {
  std::string machine, certificate, sensor_serial_number;
  std::vector<double> t_sm_mm, angles_deg;
  double turn_uncertainty_deg = 0, shift_uncertainty_um = 0;
  int valid_days = 0;
  bool draft = false;
};

absl::Status CalibrateStated(Session* session, const StatedArguments& arguments) {
  const auto t_sm_mm = ThreeOf("--t-sm-mm", arguments.t_sm_mm, "X,Y,Z");
  if (!t_sm_mm.ok()) return t_sm_mm.status();
  const auto angles_deg = ThreeOf("--angles-deg", arguments.angles_deg, "ALPHA,BETA,GAMMA");
  if (!angles_deg.ok()) return angles_deg.status();
  const Eigen::Vector3d angles = runtime::kRadPerDeg * Eigen::Vector3d(angles_deg->data());
  Eigen::Isometry3d machine_from_sensor = Eigen::Isometry3d::Identity();
  machine_from_sensor.linear() = metrology::RotationFromCardan({angles.x(), angles.y(), angles.z()});
  machine_from_sensor.translation() = Eigen::Vector3d(t_sm_mm->data());
  calibration::v1::StateSensorPoseRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  runtime::ToProto(machine_from_sensor, request.mutable_machine_from_sensor());
  request.set_turn_standard_uncertainty_deg(arguments.turn_uncertainty_deg);
  request.set_shift_standard_uncertainty_um(arguments.shift_uncertainty_um);
  request.set_certificate(arguments.certificate);
  request.set_sensor_serial_number(arguments.sensor_serial_number);
  if (arguments.valid_days > 0)
    runtime::ToProto(std::chrono::system_clock::now() + std::chrono::hours(24 * arguments.valid_days),
                     request.mutable_valid_until());
  request.set_request_id(NewRequestId());
  request.set_draft(arguments.draft);
  return CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::StateSensorPose, request,
                                          CalibrationText)
      .status();
}

}  // namespace

void AddCalibrateStatedCommand(Command* calibrate, Session* session) {
  const auto arguments = std::make_shared<StatedArguments>();
  Command* stated = calibrate->AddCommand("stated", "How a snapshot sensor stands, as its certificate has it");
  stated->AddOption("--machine", &arguments->machine, "The machine, whose sensor is of kind snapshot")->Required();
  stated
      ->AddOption(
          "--t-sm-mm", &arguments->t_sm_mm,
          "Where the sensor's origin stands with the linear axes at 0: X,Y,Z; of clouds in machine coordinates 0,0,0")
      ->Required()
      ->List();
  stated
      ->AddOption("--angles-deg", &arguments->angles_deg,
                  "Its turn, Rz(GAMMA) Ry(BETA) Rx(ALPHA): ALPHA,BETA,GAMMA; of clouds in machine coordinates 0,0,0")
      ->Required()
      ->List();
  stated
      ->AddOption("--turn-uncertainty-deg", &arguments->turn_uncertainty_deg,
                  "Standard uncertainty of its turn about each machine axis")
      ->Required();
  stated
      ->AddOption("--shift-uncertainty-um", &arguments->shift_uncertainty_um,
                  "Standard uncertainty of its place along each machine axis")
      ->Required();
  stated->AddOption("--certificate", &arguments->certificate, "What says so: number and issuer")->Required();
  stated->AddOption("--sensor-serial-number", &arguments->sensor_serial_number,
                    "Of the sensor that it was measured with");
  stated->AddOption("--valid-days", &arguments->valid_days, "How long it holds; without it, 30")->Positive();
  stated->AddFlag("--draft", &arguments->draft, "Not in force before `sixpoint calibration release`");
  session->OnCommand(stated, [session, arguments] { return CalibrateStated(session, *arguments); });
}

}  // namespace sixpoint::cli
