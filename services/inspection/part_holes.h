// A part's holes as its drawing has them, and the pins that stand in them.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/inspection/blade_inspection.h"
#include "services/clients/registered_blade.h"
#include "services/runtime/call.h"

namespace sixpoint::inspection {

// As the part's drawing has them; none where it has none.
absl::StatusOr<std::vector<metrology::InspectedHole>> HolesOf(const plant::v1::Part& part);

// Where pins stand in the part's holes; none where no scan of the registration is of pins.
absl::StatusOr<std::vector<metrology::HoleRegion>> StandingPins(const clients::BladePeers& peers,
                                                                const clients::RegisteredBlade& blade,
                                                                const runtime::Caller& caller);

}  // namespace sixpoint::inspection
