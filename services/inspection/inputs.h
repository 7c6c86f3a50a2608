// What an inspection rests on, fetched and checked, and as the kernel takes it.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/inspection/blade_inspection.h"
#include "services/clients/registered_blade.h"
#include "services/inspection/positioning.h"
#include "services/runtime/call.h"
#include "sixpoint/inspection/v1/inspection.pb.h"

namespace sixpoint::inspection {

// Whose registration converged.
struct Inputs : clients::RegisteredBlade {
  Compared compared;
  std::vector<metrology::InspectedHole> holes;
};

// FAILED_PRECONDITION with a reason: REGISTRATION_NOT_CONVERGED, PART_WITHOUT_HOLES; what the registration service refuses is
// passed on. INVALID_ARGUMENT for a scan of another blade or kind.
absl::StatusOr<Inputs> FetchInputs(const clients::BladePeers& peers, const v1::InspectRequest& request,
                                   const runtime::Caller& caller);
// What a recorded one was judged from, whatever became of it since.
absl::StatusOr<Inputs> FetchAsRecorded(const clients::BladePeers& peers, const v1::Inspection& recorded,
                                       const runtime::Caller& caller);
// Of all registrations that it rests on.
absl::StatusOr<std::vector<replay::v1::Replay>> ReplayRegistrations(const clients::BladePeers& peers,
                                                                    const v1::Inspection& recorded,
                                                                    const runtime::Caller& caller);

}  // namespace sixpoint::inspection
