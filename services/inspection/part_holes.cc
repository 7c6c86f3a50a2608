#include "services/inspection/part_holes.h"

#include <string>

#include "services/clients/error_sources.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::inspection {
namespace {

metrology::GaugePin GaugePinOf(const plant::v1::GaugePin& pin) {
  metrology::GaugePin gauge{pin.diameter_mm(), pin.diameter_standard_uncertainty_um() / 1e3, pin.greatest_play_mm()};
  if (pin.has_least_depth_mm()) gauge.least_depth_mm = pin.least_depth_mm();
  return gauge;
}

// One of its scans is of a blade with pins in its holes.
absl::StatusOr<bool> PinsStand(const clients::BladePeers& peers, const registration::v1::Registration& registration,
                               const runtime::Caller& caller) {
  for (const std::string& name : registration.scans()) {
    const auto scan = peers.scans.Get(name, caller.make_context());
    if (!scan.ok()) return scan.status();
    if (scan->header().kind() == ingest::v1::SCAN_KIND_PINS) return true;
  }
  return false;
}

}  // namespace

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
                               group.pin_standing().tilt_standard_uncertainty_deg() * runtime::kRadPerDeg};
      wanted.inclination_tolerance_rad = group.inclination_tolerance_deg() * runtime::kRadPerDeg;
    }
  }
  return holes;
}

absl::StatusOr<std::vector<metrology::HoleRegion>> StandingPins(const clients::BladePeers& peers,
                                                                const clients::RegisteredBlade& blade,
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

}  // namespace sixpoint::inspection
