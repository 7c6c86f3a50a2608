#include "services/clients/registered_blade.h"

#include <future>
#include <string>
#include <utility>

#include "services/clients/error_sources.h"
#include "services/clients/registered_pose.h"
#include "services/runtime/call_scope.h"

namespace sixpoint::clients {

absl::Status FetchRegistered(const BladePeers& peers, const runtime::Caller& caller, RegisteredBlade* blade) {
  const registration::v1::Registration& registration = blade->registration;
  if (absl::Status status = CheckConverged(registration); !status.ok()) return status;
  const auto sensor = peers.calibrations.Sensor(registration.sensor_calibration(), caller.make_context());
  if (!sensor.ok()) return sensor.status();
  blade->sensor_calibration = *sensor;
  const auto rotation = peers.calibrations.Rotation(registration.rotation_calibration(), caller.make_context());
  if (!rotation.ok()) return rotation.status();
  const auto tables = TablesOf(registration, peers.calibrations, caller.make_context);
  if (!tables.ok()) return tables.status();
  const auto machine =
      peers.plant.GetMachine(registration.machine(), registration.machine_revision(), caller.make_context());
  if (!machine.ok()) return machine.status();
  auto pose = RegisteredPoseOf(registration, sensor->sensor, *rotation, *tables, *machine);
  if (!pose.ok()) return pose.status();
  blade->pose = *std::move(pose);
  blade->sensor = sensor->sensor;
  blade->sensor.field = FieldOf(machine->sensor());
  blade->axes = rotation->axes;
  blade->machine = *machine;
  auto part = peers.plant.GetPart(registration.part(), registration.part_revision(), caller.make_context());
  if (!part.ok()) return part.status();
  blade->part = *std::move(part);
  return absl::OkStatus();
}

absl::Status FetchSurface(const BladePeers& peers, const runtime::Caller& caller, RegisteredBlade* blade) {
  auto surface = peers.plant.GetSurface(blade->part, caller.make_context());
  if (!surface.ok()) return surface.status();
  blade->surface = *std::move(surface);
  return absl::OkStatus();
}

absl::Status FetchWhole(const BladePeers& peers, const std::string& registration, bool is_new,
                        const runtime::Caller& caller, RegisteredBlade* blade) {
  auto fetched = peers.registrations.Get(registration, caller.make_context());
  if (!fetched.ok()) return fetched.status();
  blade->registration = *std::move(fetched);
  absl::Status status = FetchRegistered(peers, caller, blade);
  if (status.ok() && is_new)
    status = CalibrationClient::CheckNotMoved("registration.sensor_calibration", blade->sensor_calibration,
                                              blade->registration.scans_received_at());
  return status.ok() ? FetchSurface(peers, caller, blade) : status;
}

absl::Status ForEachScan(const ScanClient& scans, const RegisteredBlade& blade, const runtime::Caller& caller,
                         const std::function<absl::Status(int index, const StoredBlocks& scan)>& take) {
  const registration::v1::Registration& registration = blade.registration;
  if (registration.scans().empty()) return absl::OkStatus();
  const auto fetch = [&, call = runtime::CurrentCall()](int i) {
    const runtime::CallScope scope(call);
    return scans.FetchBlocks(registration.scans(i), caller.make_context());
  };
  std::future<absl::StatusOr<StoredBlocks>> next = std::async(std::launch::async, fetch, 0);
  for (int i = 0; i < registration.scans_size(); ++i) {
    absl::StatusOr<StoredBlocks> fetched = next.get();
    if (!fetched.ok()) return fetched.status();
    if (i + 1 < registration.scans_size()) next = std::async(std::launch::async, fetch, i + 1);
    const auto stretch = StretchOf({blade.machine, blade.part, fetched->record.header()});
    if (!stretch.ok()) return stretch.status();
    fetched->scan.stretch = stretch->ratio;
    if (absl::Status taken = take(i, *fetched); !taken.ok()) return taken;
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::clients
