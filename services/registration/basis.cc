#include "services/registration/basis.h"

#include <utility>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::registration {
namespace {

using runtime::NotKnown;

// Why no calibration maps a scan, and what can be done about it.
absl::Status NoneOfThen(const absl::Status& status, const std::string& scan) {
  runtime::ErrorReason reason = errors::v1::CALIBRATION_MISSING;
  if (!runtime::ReasonOf(status).empty() && !errors::v1::ErrorReason_Parse(runtime::ReasonOf(status), &reason))
    return status;  // one that a newer release knows
  return runtime::Failure(reason,
                          std::string(status.message()) + "; " + scan +
                              " was received then: say by which sensor_calibration it is to be mapped",
                          runtime::MetadataOf(status));
}

}  // namespace

absl::StatusOr<plant::v1::Part> BasisOfNow::PartOfBlade(const std::string& blade) const {
  const auto of_name = plant_.GetBlade(blade, caller_.make_context());
  if (!of_name.ok()) return NotKnown("blade", blade, of_name.status());
  auto part = plant_.GetPart(of_name->part(), 0, caller_.make_context());
  if (!part.ok()) return NotKnown("blade.part", of_name->part(), part.status());
  return part;
}

absl::StatusOr<plant::v1::Machine> BasisOfNow::Machine(const std::string& machine) const {
  auto record = plant_.GetMachine(machine, 0, caller_.make_context());
  if (!record.ok()) return NotKnown("scans[0].machine", machine, record.status());
  return record;
}

absl::StatusOr<ChosenSensor> BasisOfNow::Sensor(const ingest::v1::Scan& scan) const {
  auto of_then = calibrations_.SensorInForceAt(scan.header().machine(), scan.received_at(), caller_.make_context());
  const std::string& asked = request_.sensor_calibration();
  const bool none = absl::IsFailedPrecondition(of_then.status());
  if (asked.empty() && none) return NoneOfThen(of_then.status(), scan.name());
  if (!of_then.ok() && !none) return of_then.status();
  if (asked.empty()) return ChosenSensor{*std::move(of_then), false, scan.name()};
  auto sensor = calibrations_.Sensor(asked, caller_.make_context());
  if (!sensor.ok()) return NotKnown("sensor_calibration", asked, sensor.status());
  if (sensor->machine != scan.header().machine())
    return runtime::Refuse("sensor_calibration", asked + " of " + sensor->machine, "one of " + scan.header().machine());
  if (sensor->withdrawn)
    return runtime::Failure(errors::v1::CALIBRATION_WITHDRAWN,
                            "sensor_calibration: " + asked + ", which was withdrawn, want one that was not",
                            {{"resource", asked}});
  if (sensor->draft) return runtime::Refuse("sensor_calibration", asked + ", a draft", "one that was released");
  const bool is_another = none || of_then->name != sensor->name;
  return ChosenSensor{*std::move(sensor), is_another, scan.name()};
}

absl::Status BasisOfNow::CheckMapped(const std::string& field, const ingest::v1::Scan& scan,
                                     ChosenSensor* sensor) const {
  if (scan.name() != sensor->scan)
    if (absl::Status alike = CheckMappedAlike(scan, sensor); !alike.ok()) return alike;
  return clients::CalibrationClient::CheckNotMoved(field, sensor->calibration, scan.received_at());
}

// INVALID_ARGUMENT where another calibration was in force when this scan was received; where one was asked for, that is kept.
absl::Status BasisOfNow::CheckMappedAlike(const ingest::v1::Scan& scan, ChosenSensor* sensor) const {
  const auto of_then =
      calibrations_.SensorInForceAt(scan.header().machine(), scan.received_at(), caller_.make_context());
  const bool none = absl::IsFailedPrecondition(of_then.status());
  if (!of_then.ok() && !none) return of_then.status();
  const std::string& name = sensor->calibration.name;
  if (!none && of_then->name == name) return absl::OkStatus();
  if (!request_.sensor_calibration().empty()) {
    sensor->asked = true;
    return absl::OkStatus();
  }
  if (none) return NoneOfThen(of_then.status(), scan.name());
  return runtime::Refuse(
      "scans[" + scan.name() + "]", "received when " + of_then->name + " was in force",
      "scans of one sensor calibration, as the first of " + name + "; or sensor_calibration, to map all by one");
}

absl::StatusOr<clients::FetchedRotationCalibration> BasisOfNow::Rotation(const std::string& machine) const {
  return calibrations_.RotationInForce(machine, caller_.make_context());
}

absl::StatusOr<std::optional<clients::FetchedAxis>> BasisOfNow::Axis(const std::string& machine,
                                                                     const std::string& letter) const {
  return calibrations_.AxisInForce(machine, letter, caller_.make_context());
}

absl::StatusOr<std::optional<clients::FetchedArmStudy>> BasisOfNow::Arm(const std::string& machine) const {
  return calibrations_.ArmStudy(machine, caller_.make_own_context());
}

absl::StatusOr<plant::v1::Part> BasisOfThen::PartOfBlade(const std::string& /*blade*/) const {
  return plant_.GetPart(recorded_.part(), recorded_.part_revision(), caller_.make_context());
}

absl::StatusOr<plant::v1::Machine> BasisOfThen::Machine(const std::string& /*machine*/) const {
  return plant_.GetMachine(recorded_.machine(), recorded_.machine_revision(), caller_.make_context());
}

absl::StatusOr<ChosenSensor> BasisOfThen::Sensor(const ingest::v1::Scan& /*scan*/) const {
  auto sensor = calibrations_.Sensor(recorded_.sensor_calibration(), caller_.make_context());
  if (!sensor.ok()) return sensor.status();
  return ChosenSensor{*std::move(sensor), recorded_.sensor_calibration_asked()};
}

// It did, by what was known then.
absl::Status BasisOfThen::CheckMapped(const std::string& /*field*/, const ingest::v1::Scan& /*scan*/,
                                      ChosenSensor* /*sensor*/) const {
  return absl::OkStatus();
}

absl::StatusOr<clients::FetchedRotationCalibration> BasisOfThen::Rotation(const std::string& /*machine*/) const {
  return calibrations_.Rotation(recorded_.rotation_calibration(), caller_.make_context());
}

absl::StatusOr<std::optional<clients::FetchedAxis>> BasisOfThen::Axis(const std::string& /*machine*/,
                                                                      const std::string& letter) const {
  for (const std::string& name : inputs_) {
    const bool is_axis = name.rfind("calibrations/", 0) == 0 && name != recorded_.sensor_calibration() &&
                         name != recorded_.rotation_calibration();
    if (!is_axis) continue;
    auto axis = calibrations_.Axis(name, caller_.make_context());
    if (!axis.ok()) return axis.status();
    if (axis->axis == letter) return std::optional(*std::move(axis));
  }
  return std::nullopt;
}

absl::StatusOr<std::optional<clients::FetchedArmStudy>> BasisOfThen::Arm(const std::string& /*machine*/) const {
  for (const std::string& name : inputs_) {
    if (name.rfind("studies/", 0) != 0) continue;
    auto study = calibrations_.ArmStudyOf(name, caller_.make_own_context());
    if (!study.ok()) return study.status();
    return std::optional(*std::move(study));
  }
  return std::nullopt;
}

v1::RegisterRequest RequestOf(const v1::Registration& recorded) {
  v1::RegisterRequest request;
  request.set_blade(recorded.blade());
  *request.mutable_scans() = recorded.scans();
  request.set_method(recorded.method());
  for (const v1::ScanAngle& angle : recorded.angles())
    if (!angle.characterisation().empty()) request.set_apply_axis_tables(true);
  if (recorded.has_options()) *request.mutable_options() = recorded.options();
  request.set_for_inspection(recorded.for_inspection());
  request.set_clamping(recorded.clamping());
  request.set_sensor_calibration(recorded.sensor_calibration());
  return request;
}

}  // namespace sixpoint::registration
