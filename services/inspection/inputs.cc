#include "services/inspection/inputs.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "services/clients/error_sources.h"
#include "services/clients/registered_pose.h"
#include "services/inspection/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"

namespace sixpoint::inspection {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180;

absl::Status CheckScans(const Peers& peers, const v1::InspectRequest& request, const runtime::Caller& caller) {
  for (int i = 0; i < request.scans_size(); ++i) {
    const auto scan = peers.scans.Get(request.scans(i), caller.make_context());
    if (!scan.ok()) return scan.status();
    if (absl::Status status = CheckScan(i, scan->header(), request.blade()); !status.ok()) return status;
  }
  return absl::OkStatus();
}

metrology::GaugePin GaugePinOf(const plant::v1::GaugePin& pin) {
  metrology::GaugePin gauge{pin.diameter_mm(), pin.diameter_standard_uncertainty_um() / 1e3, pin.greatest_play_mm()};
  if (pin.has_least_depth_mm()) gauge.least_depth_mm = pin.least_depth_mm();
  return gauge;
}

absl::StatusOr<std::vector<metrology::InspectedHole>> HolesOf(const plant::v1::Part& part) {
  std::vector<metrology::InspectedHole> holes;
  for (const plant::v1::HoleGroup& group : part.hole_groups()) {
    const std::string field = "part.hole_groups." + group.group();
    const auto axis = runtime::FromProto(field + ".axis_in_part", group.axis_in_part());
    if (!axis.ok()) return axis.status();
    for (const plant::v1::Hole& hole : group.holes()) {
      const auto start = runtime::FromProto(field + "." + hole.hole() + ".start_in_part_mm", hole.start_in_part_mm());
      if (!start.ok()) return start.status();
      const auto normal = runtime::FromProto(field + "." + hole.hole() + ".normal_in_part", hole.normal_in_part());
      if (!normal.ok()) return normal.status();
      metrology::InspectedHole& wanted = holes.emplace_back();
      wanted.group = group.group();
      wanted.name = hole.hole();
      wanted.pin = {*start, *axis, *normal, group.diameter_mm(), group.depth_mm()};
      wanted.position_tolerance_mm = clients::GreatestPositionError_mm(group);
      if (group.has_gauge_pin()) wanted.pin.gauge = GaugePinOf(group.gauge_pin());
      if (group.has_pin_standing())
        wanted.pin.standing = {1e-3 * group.pin_standing().clearance_standard_uncertainty_um(),
                               group.pin_standing().tilt_standard_uncertainty_deg() * kRad};
      wanted.inclination_tolerance_rad = group.inclination_tolerance_deg() * kRad;
    }
  }
  if (holes.empty()) {
    return runtime::Failure(errors::v1::PART_WITHOUT_HOLES, part.name() + ".hole_groups: no holes, want at least one",
                            {{"resource", part.name()}});
  }
  return holes;
}

double TightestUm(const std::vector<metrology::InspectedHole>& holes) {
  double tightest_um = std::numeric_limits<double>::infinity();
  for (const metrology::InspectedHole& hole : holes)
    tightest_um = std::min(tightest_um, 1e3 * hole.position_tolerance_mm);
  return tightest_um;
}

absl::Status FetchPose(const Peers& peers, const runtime::Caller& caller, Inputs* inputs) {
  const registration::v1::Registration& registration = inputs->registration;
  const auto sensor = peers.calibrations.Sensor(registration.sensor_calibration(), caller.make_context());
  if (!sensor.ok()) return sensor.status();
  inputs->sensor_calibration = *sensor;
  const auto rotation = peers.calibrations.Rotation(registration.rotation_calibration(), caller.make_context());
  if (!rotation.ok()) return rotation.status();
  const auto tables = clients::TablesOf(registration, peers.calibrations, caller.make_context);
  if (!tables.ok()) return tables.status();
  const auto machine =
      peers.plant.GetMachine(registration.machine(), registration.machine_revision(), caller.make_context());
  if (!machine.ok()) return machine.status();
  auto pose = clients::RegisteredPoseOf(registration, sensor->sensor, *rotation, *tables, *machine);
  if (!pose.ok()) return pose.status();
  inputs->pose = *std::move(pose);
  inputs->sensor = sensor->sensor;
  inputs->sensor.field = clients::FieldOf(machine->sensor());
  inputs->axes = rotation->axes;
  inputs->machine = *machine;
  return absl::OkStatus();
}

// By the inspection's entry in the journal.
std::vector<std::string> RegistrationsOf(const plant::v1::RecordEntry& inspection) {
  std::vector<std::string> names;
  for (const std::string& name : inspection.inputs())
    if (name.rfind("registrations/", 0) == 0) names.push_back(name);
  return names;
}

// All else follows from the registration that the verdict rests on: inputs->registration.
absl::Status FetchByRegistration(const Peers& peers, const OtherPositioning& other, const runtime::Caller& caller,
                                 Inputs* inputs) {
  if (absl::Status status = clients::CheckConverged(inputs->registration); !status.ok()) return status;
  if (absl::Status status = FetchPose(peers, caller, inputs); !status.ok()) return status;
  const auto part =
      peers.plant.GetPart(inputs->registration.part(), inputs->registration.part_revision(), caller.make_context());
  if (!part.ok()) return part.status();
  auto holes = HolesOf(*part);
  if (!holes.ok()) return holes.status();
  inputs->holes = *std::move(holes);
  inputs->part = *part;
  auto compared = Compare(other, inputs->registration, TightestUm(inputs->holes));
  if (!compared.ok()) return compared.status();
  inputs->compared = *std::move(compared);
  auto surface = peers.plant.GetSurface(*part, caller.make_context());
  if (!surface.ok()) return surface.status();
  inputs->surface = *std::move(surface);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Inputs> FetchInputs(const Peers& peers, const v1::InspectRequest& request,
                                   const runtime::Caller& caller) {
  if (absl::Status status = CheckScans(peers, request, caller); !status.ok()) return status;
  absl::StatusOr<registration::v1::Registration> registration = RegisterAsked(peers, request, caller);
  if (!registration.ok()) return registration.status();
  Inputs inputs;
  inputs.registration = *std::move(registration);
  absl::Status status = FetchByRegistration(peers, RegisteredNow(peers, request, caller), caller, &inputs);
  if (status.ok())
    status = clients::CalibrationClient::CheckNotMoved("registration.sensor_calibration", inputs.sensor_calibration,
                                                       inputs.registration.scans_received_at());
  if (!status.ok()) return status;
  return inputs;
}

absl::StatusOr<Inputs> FetchAsRecorded(const Peers& peers, const v1::Inspection& recorded,
                                       const runtime::Caller& caller) {
  Inputs inputs;
  const auto entry = peers.plant.GetRecordEntry(recorded.name(), caller.make_context());
  if (!entry.ok()) return entry.status();
  std::vector<registration::v1::Registration> others;
  for (const std::string& name : RegistrationsOf(*entry)) {
    auto registration = peers.registrations.Get(name, caller.make_context());
    if (!registration.ok()) return registration.status();
    if (name == recorded.registration())
      inputs.registration = *std::move(registration);
    else
      others.push_back(*std::move(registration));
  }
  if (absl::Status status = FetchByRegistration(peers, RegisteredThen(others), caller, &inputs); !status.ok())
    return status;
  return inputs;
}

absl::StatusOr<std::vector<replay::v1::Replay>> ReplayRegistrations(const Peers& peers, const v1::Inspection& recorded,
                                                                    const runtime::Caller& caller) {
  const auto entry = peers.plant.GetRecordEntry(recorded.name(), caller.make_context());
  if (!entry.ok()) return entry.status();
  std::vector<replay::v1::Replay> replays;
  for (const std::string& name : RegistrationsOf(*entry)) {
    auto replay = peers.registrations.Replay(name, caller.make_context());
    if (!replay.ok()) return replay.status();
    replays.push_back(*std::move(replay));
  }
  return replays;
}

}  // namespace sixpoint::inspection
