#include "services/inspection/registered_blade.h"

#include <future>
#include <string>
#include <utility>

#include "services/clients/error_sources.h"
#include "services/clients/registered_pose.h"
#include "services/runtime/call_scope.h"
#include "services/runtime/geometry_proto.h"

namespace sixpoint::inspection {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180;

metrology::GaugePin GaugePinOf(const plant::v1::GaugePin& pin) {
  metrology::GaugePin gauge{pin.diameter_mm(), pin.diameter_standard_uncertainty_um() / 1e3, pin.greatest_play_mm()};
  if (pin.has_least_depth_mm()) gauge.least_depth_mm = pin.least_depth_mm();
  return gauge;
}

// One of its scans is of a blade with pins in its holes.
absl::StatusOr<bool> PinsStand(const Peers& peers, const registration::v1::Registration& registration,
                               const runtime::Caller& caller) {
  for (const std::string& name : registration.scans()) {
    const auto scan = peers.scans.Get(name, caller.make_context());
    if (!scan.ok()) return scan.status();
    if (scan->header().kind() == ingest::v1::SCAN_KIND_PINS) return true;
  }
  return false;
}

}  // namespace

absl::Status FetchRegistered(const Peers& peers, const runtime::Caller& caller, RegisteredBlade* blade) {
  const registration::v1::Registration& registration = blade->registration;
  if (absl::Status status = clients::CheckConverged(registration); !status.ok()) return status;
  const auto sensor = peers.calibrations.Sensor(registration.sensor_calibration(), caller.make_context());
  if (!sensor.ok()) return sensor.status();
  blade->sensor_calibration = *sensor;
  const auto rotation = peers.calibrations.Rotation(registration.rotation_calibration(), caller.make_context());
  if (!rotation.ok()) return rotation.status();
  const auto tables = clients::TablesOf(registration, peers.calibrations, caller.make_context);
  if (!tables.ok()) return tables.status();
  const auto machine =
      peers.plant.GetMachine(registration.machine(), registration.machine_revision(), caller.make_context());
  if (!machine.ok()) return machine.status();
  auto pose = clients::RegisteredPoseOf(registration, sensor->sensor, *rotation, *tables, *machine);
  if (!pose.ok()) return pose.status();
  blade->pose = *std::move(pose);
  blade->sensor = sensor->sensor;
  blade->sensor.field = clients::FieldOf(machine->sensor());
  blade->axes = rotation->axes;
  blade->machine = *machine;
  auto part = peers.plant.GetPart(registration.part(), registration.part_revision(), caller.make_context());
  if (!part.ok()) return part.status();
  blade->part = *std::move(part);
  return absl::OkStatus();
}

absl::Status FetchSurface(const Peers& peers, const runtime::Caller& caller, RegisteredBlade* blade) {
  auto surface = peers.plant.GetSurface(blade->part, caller.make_context());
  if (!surface.ok()) return surface.status();
  blade->surface = *std::move(surface);
  return absl::OkStatus();
}

absl::Status FetchWhole(const Peers& peers, const std::string& registration, bool is_new, const runtime::Caller& caller,
                        RegisteredBlade* blade) {
  auto fetched = peers.registrations.Get(registration, caller.make_context());
  if (!fetched.ok()) return fetched.status();
  blade->registration = *std::move(fetched);
  absl::Status status = FetchRegistered(peers, caller, blade);
  if (status.ok() && is_new)
    status = clients::CalibrationClient::CheckNotMoved("registration.sensor_calibration", blade->sensor_calibration,
                                                       blade->registration.scans_received_at());
  return status.ok() ? FetchSurface(peers, caller, blade) : status;
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
  return holes;
}

absl::StatusOr<std::vector<metrology::HoleRegion>> StandingPins(const Peers& peers, const RegisteredBlade& blade,
                                                                const runtime::Caller& caller) {
  std::vector<metrology::HoleRegion> pins;
  const auto stand = PinsStand(peers, blade.registration, caller);
  if (!stand.ok()) return stand.status();
  if (!*stand) return pins;
  const auto holes = HolesOf(blade.part);
  if (!holes.ok()) return holes.status();
  for (const metrology::InspectedHole& hole : *holes) pins.push_back(metrology::PinRegionOf(hole, {}));
  return pins;
}

absl::Status ForEachScan(const clients::ScanClient& scans, const RegisteredBlade& blade, const runtime::Caller& caller,
                         const std::function<absl::Status(int index, const clients::StoredBlocks& scan)>& take) {
  const registration::v1::Registration& registration = blade.registration;
  if (registration.scans().empty()) return absl::OkStatus();
  const auto fetch = [&, call = runtime::CurrentCall()](int i) {
    const runtime::CallScope scope(call);
    return scans.FetchBlocks(registration.scans(i), caller.make_context());
  };
  std::future<absl::StatusOr<clients::StoredBlocks>> next = std::async(std::launch::async, fetch, 0);
  for (int i = 0; i < registration.scans_size(); ++i) {
    absl::StatusOr<clients::StoredBlocks> fetched = next.get();
    if (!fetched.ok()) return fetched.status();
    if (i + 1 < registration.scans_size()) next = std::async(std::launch::async, fetch, i + 1);
    const auto stretch = clients::StretchOf({blade.machine, blade.part, fetched->record.header()});
    if (!stretch.ok()) return stretch.status();
    fetched->scan.stretch = stretch->ratio;
    if (absl::Status taken = take(i, *fetched); !taken.ok()) return taken;
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::inspection
