#include "cli/plant_run/calibration_calls.h"

#include "services/runtime/resource_name.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"
#include "sixpoint/calibration/v1/study.grpc.pb.h"

namespace sixpoint::cli {

using calibration::v1::CalibrationService;
using calibration::v1::StudyService;

absl::Status CalibrateSensor(Session* session, const Dataset& dataset, const std::vector<std::string>& scans,
                             calibration::v1::Calibration* out) {
  calibration::v1::CalibrateSensorRequest request;
  request.set_machine(runtime::NameOf("machines", dataset.machine_id));
  request.set_artefact(runtime::NameOf("artefacts", dataset.artefact_id));
  request.mutable_scans()->Add(scans.begin(), scans.end());
  *request.mutable_touch() = dataset.touch;
  request.set_method(calibration::v1::SENSOR_METHOD_JOINT);
  request.set_request_id(NewRequestId());
  return session->Call<CalibrationService>("calibration", &CalibrationService::Stub::CalibrateSensor, request, out);
}

absl::Status CharacteriseAxes(Session* session, const Dataset& dataset) {
  for (const auto& [axis, run] : dataset.axis_runs) {
    calibration::v1::CharacteriseAxisRequest request;
    request.set_machine(runtime::NameOf("machines", dataset.machine_id));
    request.set_axis(axis);
    *request.mutable_run() = run;
    request.set_request_id(NewRequestId());
    calibration::v1::Calibration made;
    absl::Status status =
        session->Call<CalibrationService>("calibration", &CalibrationService::Stub::CharacteriseAxis, request, &made);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status CalibrateRotation(Session* session, const Dataset& dataset, calibration::v1::Calibration* out) {
  calibration::v1::CalibrateRotationRequest request;
  request.set_machine(runtime::NameOf("machines", dataset.machine_id));
  request.mutable_poses()->Add(dataset.sphere_poses.begin(), dataset.sphere_poses.end());
  request.set_method(calibration::v1::ROTATION_METHOD_LINES);
  request.set_apply_axis_tables(dataset.applies_axis_tables());
  request.set_request_id(NewRequestId());
  return session->Call<CalibrationService>("calibration", &CalibrationService::Stub::CalibrateRotation, request, out);
}

absl::Status StudyArm(Session* session, const std::vector<std::string>& scans, const std::string& sensor_calibration) {
  calibration::v1::RunArmStudyRequest request;
  request.mutable_scans()->Add(scans.begin(), scans.end());
  request.set_sensor_calibration(sensor_calibration);
  request.set_request_id(NewRequestId());
  calibration::v1::Study study;
  return session->Call<StudyService>("calibration", &StudyService::Stub::RunArmStudy, request, &study);
}

}  // namespace sixpoint::cli
