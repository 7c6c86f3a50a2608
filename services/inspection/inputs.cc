#include "services/inspection/inputs.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "services/inspection/part_holes.h"
#include "services/inspection/validate.h"
#include "services/runtime/errors.h"

namespace sixpoint::inspection {
namespace {

absl::Status CheckScans(const clients::BladePeers& peers, const v1::InspectRequest& request,
                        const runtime::Caller& caller) {
  for (int i = 0; i < request.scans_size(); ++i) {
    const auto scan = peers.scans.Get(request.scans(i), caller.make_context());
    if (!scan.ok()) return scan.status();
    if (absl::Status status = CheckScan(i, scan->header(), request.blade()); !status.ok()) return status;
  }
  return absl::OkStatus();
}

double TightestUm(const std::vector<metrology::InspectedHole>& holes) {
  double tightest_um = std::numeric_limits<double>::infinity();
  for (const metrology::InspectedHole& hole : holes)
    tightest_um = std::min(tightest_um, 1e3 * hole.position_tolerance_mm);
  return tightest_um;
}

// By the inspection's entry in the journal.
std::vector<std::string> RegistrationsOf(const plant::v1::RecordEntry& inspection) {
  std::vector<std::string> names;
  for (const std::string& name : inspection.inputs())
    if (name.rfind("registrations/", 0) == 0) names.push_back(name);
  return names;
}

// All else follows from the registration that the verdict rests on: inputs->registration.
absl::Status FetchByRegistration(const clients::BladePeers& peers, const OtherPositioning& other,
                                 const runtime::Caller& caller, Inputs* inputs) {
  if (absl::Status status = clients::FetchRegistered(peers, caller, inputs); !status.ok()) return status;
  auto holes = HolesOf(inputs->part);
  if (!holes.ok()) return holes.status();
  if (holes->empty())
    return runtime::Failure(errors::v1::PART_WITHOUT_HOLES,
                            inputs->part.name() + ".hole_groups: no holes, want at least one",
                            {{"resource", inputs->part.name()}});
  inputs->holes = *std::move(holes);
  auto compared = Compare(other, inputs->registration, TightestUm(inputs->holes));
  if (!compared.ok()) return compared.status();
  inputs->compared = *std::move(compared);
  return clients::FetchSurface(peers, caller, inputs);
}

}  // namespace

absl::StatusOr<Inputs> FetchInputs(const clients::BladePeers& peers, const v1::InspectRequest& request,
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

absl::StatusOr<Inputs> FetchAsRecorded(const clients::BladePeers& peers, const v1::Inspection& recorded,
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

absl::StatusOr<std::vector<replay::v1::Replay>> ReplayRegistrations(const clients::BladePeers& peers,
                                                                    const v1::Inspection& recorded,
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
