#include "services/calibration/inputs.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <set>
#include <utility>

#include "services/calibration/newest_arm.h"
#include "services/calibration/refusals.h"
#include "services/calibration/validate.h"
#include "services/clients/references.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/machine_chain.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::calibration {
namespace {

using runtime::NotKnown;
using runtime::Refuse;

constexpr std::size_t kMostPoints = 20'000'000;
constexpr double kFarthestSensorMm = 1e5;  // as far as an axis goes

// What all scans have alike, and when they came.
void Take(const ingest::v1::Scan& scan, SensorInputs* inputs) {
  const bool first = inputs->scans.empty();
  const ingest::v1::ScanHeader& header = scan.header();
  const auto alike = [&](const std::string& value, std::string* of_all) {
    *of_all = first || value == *of_all ? value : "";
  };
  alike(header.arm_series(), &inputs->arm_series);
  alike(header.sensor_serial_number(), &inputs->sensor_serial_number);
  inputs->travel = first || header.travel() == inputs->travel ? header.travel() : ingest::v1::SCAN_TRAVEL_UNSPECIFIED;
  const storage::Instant received = runtime::MomentOf(scan.received_at());
  inputs->first_received_at = first ? received : std::min(inputs->first_received_at, received);
  inputs->last_received_at = first ? received : std::max(inputs->last_received_at, received);
}

// The machine's rotary joint of that letter; refuses others.
absl::StatusOr<metrology::Joint> JointOf(const std::string& machine, const metrology::JointChain& chain,
                                         const std::string& axis) {
  std::string rotary;
  for (const metrology::Joint& joint : chain.joints()) {
    if (joint.motion.kind != metrology::JointKind::kRotary) continue;
    if (joint.axis == axis) return joint;
    rotary += (rotary.empty() ? "" : ", ") + joint.axis;
  }
  return Refuse("axis", axis, "a rotary axis of " + machine + ": " + (rotary.empty() ? "it has none" : rotary));
}

metrology::AngleTable TableOf(const storage::AxisCharacterisationRow& row) {
  metrology::AngleTable table;
  for (const double deg : row.forward_error_deg) table.forward_rad.push_back(deg * runtime::kRadPerDeg);
  for (const double deg : row.backward_error_deg) table.backward_rad.push_back(deg * runtime::kRadPerDeg);
  return table;
}

}  // namespace

InputFetcher::InputFetcher(std::shared_ptr<const storage::CalibrationReader> calibrations,
                           std::shared_ptr<const storage::StudyStore> studies, std::shared_ptr<grpc::Channel> plant,
                           std::shared_ptr<grpc::Channel> ingest, int thread_count)
    : calibrations_(std::move(calibrations)),
      studies_(std::move(studies)),
      plant_(std::move(plant)),
      scans_(std::move(ingest)),
      thread_count_(thread_count) {}

absl::StatusOr<SensorInputs> InputFetcher::Fetch(const v1::CalibrateSensorRequest& request,
                                                 const Caller& caller) const {
  absl::StatusOr<metrology::ArtefactTouch> touch = TouchOf(request.touch());
  if (!touch.ok()) return touch.status();
  const absl::StatusOr<Validity> validity = ValidityIn(request, calibrations_->Now(caller.deadline));
  if (!validity.ok()) return validity.status();
  SensorInputs inputs;
  inputs.touch = *std::move(touch);
  inputs.validity = *validity;
  const auto machine = FetchMachine(request.machine(), caller, &inputs);
  if (!machine.ok()) return machine.status();
  if (absl::Status s = clients::CheckLineScanner(*machine); !s.ok()) return s;
  inputs.options.optics = OpticsOf(machine->sensor());
  inputs.options.field = metrology::ScannerField::Of(machine->sensor().mid_range_mm(), machine->sensor().range_mm(),
                                                     machine->sensor().line_angle_deg() * runtime::kRadPerDeg);
  inputs.options.threads = thread_count_;
  inputs.options.keep_going = caller.keep_going;
  const absl::StatusOr<plant::v1::Artefact> record = plant_.GetArtefact(request.artefact(), 0, caller.make_context());
  if (!record.ok()) return NotKnown("artefact", request.artefact(), record.status());
  inputs.names.push_back(
      runtime::RevisedName("artefacts", runtime::LastSegment(request.artefact()), record->revision()));
  absl::StatusOr<metrology::Artefact> artefact = ArtefactOf(*record);
  if (!artefact.ok()) return WithReason(artefact.status());
  inputs.artefact = *std::move(artefact);
  // Before the scans, which take longer.
  if (absl::Status s = metrology::CheckTouch(inputs.artefact, inputs.touch); !s.ok()) return WithReason(s);
  if (absl::Status s = FetchScans(request, caller, &inputs); !s.ok()) return s;
  if (absl::Status s = FetchArm(request.machine(), caller, &inputs); !s.ok()) return s;
  // What is scanned from its first scan on, the sensor standing as it did there, is mapped by it.
  if (!request.has_valid_from()) {
    const bool until_given = request.has_valid_until();
    const auto reaching = ValidityOf(nullptr, until_given ? &request.valid_until() : nullptr, inputs.first_received_at);
    if (!reaching.ok()) return reaching.status();
    inputs.validity = *reaching;
  }
  inputs.options.field_standard_uncertainty_mm = 1e-3 * machine->error_sources().scanner_field_um();
  inputs.options.centre_standard_uncertainty_mm = 1e-3 * record->centre_standard_uncertainty_um();
  inputs.options.flatness_standard_uncertainty_mm = 1e-3 * record->flatness_standard_uncertainty_um();
  if (absl::Status s = clients::CheckCertificate(record->name() + ".certificate", record->has_certificate(),
                                                 record->certificate(), inputs.last_received_at);
      !s.ok())
    return s;
  if (absl::Status s = clients::CheckTouchProbe(*machine, inputs.last_received_at); !s.ok()) return s;
  return inputs;
}

absl::Status InputFetcher::FetchScans(const v1::CalibrateSensorRequest& request, const Caller& caller,
                                      SensorInputs* inputs) const {
  ingest::v1::Scan first;
  std::size_t point_count = 0;
  for (const std::string& name : request.scans()) {
    absl::StatusOr<clients::FetchedScan> fetched = scans_.Fetch(name, caller.make_context());
    if (!fetched.ok()) return NotKnown("scans", name, fetched.status());
    if (inputs->scans.empty()) first = fetched->record;
    if (absl::Status s = CheckScan(request, fetched->record, first); !s.ok()) return s;
    point_count += fetched->scan.points_mm.size();
    if (point_count > kMostPoints)
      return Refuse("scans", std::to_string(point_count) + " points", "at most 20000000 together");
    Take(fetched->record, inputs);
    inputs->series_of_scans.push_back(fetched->record.header().arm_series());
    fetched->scan.id = runtime::LastSegment(name);
    inputs->scans.push_back(std::move(fetched->scan));
    inputs->names.push_back(name);
  }
  return absl::OkStatus();
}

absl::Status InputFetcher::FetchArm(const std::string& machine, const Caller& caller, SensorInputs* inputs) const {
  const std::set<std::string> series(inputs->series_of_scans.begin(), inputs->series_of_scans.end());
  if (series.size() < 2 || series.count("") > 0) return absl::OkStatus();
  const auto arm = NewestArm(*studies_, machine, caller.deadline);
  if (!arm.ok() || !arm->has_value()) return arm.status();
  inputs->arm = (*arm)->spread;
  inputs->names.push_back((*arm)->name);
  return absl::OkStatus();
}

absl::StatusOr<StatedInputs> InputFetcher::Fetch(const v1::StateSensorPoseRequest& request,
                                                 const Caller& caller) const {
  const auto pose = runtime::FromProto("machine_from_sensor", request.machine_from_sensor());
  if (!pose.ok()) return pose.status();
  if (const double farthest_mm = pose->translation().cwiseAbs().maxCoeff(); !(farthest_mm <= kFarthestSensorMm))
    return Refuse("machine_from_sensor.translation_mm", farthest_mm, "each within +-100000");
  const absl::StatusOr<Validity> validity = ValidityIn(request, calibrations_->Now(caller.deadline));
  if (!validity.ok()) return validity.status();
  StatedInputs inputs;
  inputs.machine_from_sensor = *pose;
  inputs.validity = *validity;
  const auto machine = FetchMachine(request.machine(), caller, &inputs);
  if (!machine.ok()) return machine.status();
  if (absl::Status s = clients::CheckSnapshotSensor(*machine); !s.ok()) return s;
  const std::string& serial = machine->sensor().serial_number();
  if (!request.sensor_serial_number().empty() && !serial.empty() && request.sensor_serial_number() != serial)
    return Refuse("sensor_serial_number", request.sensor_serial_number(),
                  serial + ", the sensor of " + machine->name());
  return inputs;
}

absl::StatusOr<RotationInputs> InputFetcher::Fetch(const v1::CalibrateRotationRequest& request,
                                                   const Caller& caller) const {
  absl::StatusOr<std::vector<metrology::SpherePose>> poses = PosesOf(request);
  if (!poses.ok()) return poses.status();
  const absl::StatusOr<Validity> validity = ValidityIn(request, calibrations_->Now(caller.deadline));
  if (!validity.ok()) return validity.status();
  RotationInputs inputs;
  inputs.poses = *std::move(poses);
  inputs.validity = *validity;
  if (request.has_standard()) {
    absl::StatusOr<metrology::StandardProbing> standard = ProbingOf(request.standard());
    if (!standard.ok()) return standard.status();
    inputs.standard = *std::move(standard);
  }
  const auto machine = FetchMachine(request.machine(), caller, &inputs);
  if (!machine.ok()) return machine.status();
  if (absl::Status s = CheckTouchedNow(*machine, caller); !s.ok()) return s;
  absl::StatusOr<metrology::RotationOptions> options = RotationOptionsOf(*machine);
  if (!options.ok()) return options.status();
  inputs.options = *std::move(options);
  inputs.options.standard_uncertainty_mm = 1e-3 * request.standard_uncertainty_um();
  if (request.apply_axis_tables())
    if (absl::Status s = FetchAxisTables(request.machine(), caller, &inputs); !s.ok()) return s;
  return inputs;
}

absl::Status InputFetcher::FetchAxisTables(const std::string& machine, const Caller& caller,
                                           RotationInputs* inputs) const {
  const absl::StatusOr<storage::Instant> now = calibrations_->Now(caller.deadline);
  if (!now.ok()) return now.status();
  const std::string machine_id = runtime::LastSegment(machine);
  bool found = false;
  for (metrology::RotaryJoint& joint : inputs->options.joints) {
    const auto in_force = calibrations_->InForce({machine_id, "axis", joint.axis}, *now, caller.deadline);
    if (!in_force.ok()) return in_force.status();
    if (!in_force->has_value()) continue;
    joint.table = TableOf(*(**in_force).axis);
    inputs->names.push_back((**in_force).name());
    found = true;
  }
  if (found) return absl::OkStatus();
  return runtime::Failure(errors::v1::AXIS_NOT_CHARACTERISED,
                          machine + ": neither " + inputs->options.joints[0].axis + " nor " +
                              inputs->options.joints[1].axis +
                              " has a characterisation in force, want one of either; run `calibrate axis` first",
                          {{"resource", machine}});
}

absl::StatusOr<ProbeInputs> InputFetcher::Fetch(const v1::CalibrateProbeRequest& request, const Caller& caller) const {
  absl::StatusOr<ProbeReadings> measured = ProbeReadingsOf(request);
  if (!measured.ok()) return measured.status();
  const absl::StatusOr<Validity> validity = ValidityIn(request, calibrations_->Now(caller.deadline));
  if (!validity.ok()) return validity.status();
  ProbeInputs inputs;
  inputs.measured = *std::move(measured);
  inputs.validity = *validity;
  const auto machine = FetchMachine(request.machine(), caller, &inputs);
  if (!machine.ok()) return machine.status();
  if (absl::Status s = CheckTouchedNow(*machine, caller); !s.ok()) return s;
  return inputs;
}

absl::StatusOr<AxisInputs> InputFetcher::Fetch(const v1::CharacteriseAxisRequest& request, const Caller& caller) const {
  absl::StatusOr<std::vector<metrology::AxisReading>> readings = ReadingsOf(request.run());
  if (!readings.ok()) return readings.status();
  const absl::StatusOr<Validity> validity =
      ValidityIn(request, calibrations_->Now(caller.deadline), kUsualAxisValidity);
  if (!validity.ok()) return validity.status();
  AxisInputs inputs;
  inputs.readings = *std::move(readings);
  inputs.validity = *validity;
  const auto machine = FetchMachine(request.machine(), caller, &inputs);
  if (!machine.ok()) return machine.status();
  const absl::StatusOr<metrology::JointChain> chain = runtime::ChainOf(*machine);
  if (!chain.ok()) return chain.status();
  absl::StatusOr<metrology::Joint> joint = JointOf(request.machine(), *chain, request.axis());
  if (!joint.ok()) return joint.status();
  inputs.joint = *std::move(joint);
  return inputs;
}

absl::Status InputFetcher::CheckTouchedNow(const plant::v1::Machine& machine, const Caller& caller) const {
  const absl::StatusOr<storage::Instant> now = calibrations_->Now(caller.deadline);
  return now.ok() ? clients::CheckTouchProbe(machine, *now) : now.status();
}

absl::StatusOr<plant::v1::Machine> InputFetcher::FetchMachine(const std::string& name, const Caller& caller,
                                                              Inputs* inputs) const {
  absl::StatusOr<plant::v1::Machine> machine = plant_.GetMachine(name, 0, caller.make_context());
  if (!machine.ok()) return NotKnown("machine", name, machine.status());
  inputs->names.push_back(runtime::RevisedName("machines", runtime::LastSegment(name), machine->revision()));
  return machine;
}

absl::StatusOr<metrology::Artefact> ArtefactOf(const plant::v1::Artefact& in) {
  metrology::Artefact artefact;
  artefact.side_mm = in.side_mm();
  for (const plant::v1::NamedPlanePoint& c : in.cones()) artefact.cones.push_back({c.feature(), {c.x_mm(), c.y_mm()}});
  artefact.cone_half_angle_rad = in.cone_half_angle_deg() * runtime::kRadPerDeg;
  artefact.cone_top_radius_mm = in.cone_top_radius_mm();
  artefact.cone_bottom_radius_mm = in.cone_bottom_radius_mm();
  for (const plant::v1::NamedPlanePoint& q : in.slots()) artefact.slots.push_back({q.feature(), {q.x_mm(), q.y_mm()}});
  artefact.slot_width_mm = in.slot_width_mm();
  artefact.slot_depth_mm = in.slot_depth_mm();
  if (absl::Status s = metrology::Validate(artefact); !s.ok()) return s;
  return artefact;
}

metrology::LineSensorOptics OpticsOf(const plant::v1::Sensor& sensor) {
  metrology::LineSensorOptics optics;
  if (std::isfinite(sensor.mid_range_mm()) && sensor.mid_range_mm() > 0) optics.mid_range_mm = sensor.mid_range_mm();
  if (std::isfinite(sensor.noise_um()) && sensor.noise_um() > 0) optics.noise_mm = 1e-3 * sensor.noise_um();
  return optics;
}

absl::StatusOr<metrology::RotationOptions> RotationOptionsOf(const plant::v1::Machine& machine) {
  const absl::StatusOr<metrology::JointChain> chain = runtime::ChainOf(machine);
  if (!chain.ok()) return chain.status();
  absl::StatusOr<metrology::RotationOptions> options = metrology::RotationOptions::Of(*chain);
  if (!options.ok())
    return runtime::Failure(errors::v1::KINEMATICS_UNSUITABLE,
                            machine.name() + "." + std::string(options.status().message()),
                            {{"resource", machine.name()}});
  return options;
}

}  // namespace sixpoint::calibration
