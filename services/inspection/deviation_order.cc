#include "services/inspection/deviation_order.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "services/inspection/order_checks.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/decision_rule_proto.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/units.h"

namespace sixpoint::inspection {
namespace {

constexpr double kGreatestLimit_mm = 100;

absl::StatusOr<DeviationOrder::Profile> ProfileOf(const std::string& field, const v1::ProfileTolerance& in,
                                                  const std::vector<DeviationOrder::Region>& regions) {
  DeviationOrder::Profile profile;
  profile.characteristic = in.characteristic();
  runtime::Refusals refusals;
  if (!in.region().empty()) {
    const auto found = std::find_if(regions.begin(), regions.end(),
                                    [&](const DeviationOrder::Region& region) { return region.name == in.region(); });
    if (found == regions.end())
      refusals.Add(runtime::Refuse(field + ".region", in.region(), "one of `regions`, or none"));
    profile.region = 1 + static_cast<std::size_t>(found - regions.begin());
  }
  if (in.zone() != v1::PROFILE_ZONE_FORM && in.zone() != v1::PROFILE_ZONE_FORM_AND_LOCATION)
    refusals.Add(runtime::Refuse(field + ".zone", v1::ProfileZone_Name(in.zone()),
                                 "PROFILE_ZONE_FORM_AND_LOCATION or PROFILE_ZONE_FORM"));
  profile.tolerance.zone =
      in.zone() == v1::PROFILE_ZONE_FORM ? metrology::ProfileZone::kForm : metrology::ProfileZone::kFormAndLocation;
  const auto limit = [&](const char* which, bool stated, double value_mm, double* to_mm) {
    if (!stated)
      refusals.Add(runtime::Refuse(field + which, "not stated", "mm of the deviation"));
    else if (!(std::abs(value_mm) <= kGreatestLimit_mm))
      refusals.Add(runtime::Refuse(field + which, value_mm, "-100 to 100 mm"));
    *to_mm = value_mm;
  };
  limit(".lower_mm", in.has_lower_mm(), in.lower_mm(), &profile.tolerance.lower_mm);
  limit(".upper_mm", in.has_upper_mm(), in.upper_mm(), &profile.tolerance.upper_mm);
  if (in.has_lower_mm() && in.has_upper_mm() && !(in.lower_mm() < in.upper_mm()))
    refusals.Add(runtime::Refuse(field + ".lower_mm", in.lower_mm(), "below upper_mm"));
  if (in.has_least_coverage()) {
    profile.tolerance.least_coverage = in.least_coverage();
    if (!(in.least_coverage() >= 0 && in.least_coverage() <= 1))
      refusals.Add(runtime::Refuse(field + ".least_coverage", in.least_coverage(), "0 to 1"));
  }
  if (in.has_decision_rule()) {
    refusals.Add(runtime::ReadDecisionRule(field + ".decision_rule", in.decision_rule(), &profile.rule));
    profile.tolerance.rule = KernelRuleOf(in.decision_rule());
  }
  if (!refusals.status().ok()) return refusals.status();
  return profile;
}

}  // namespace

absl::StatusOr<DeviationOrder::Region> KernelRegionOf(const std::string& field, const v1::SurfaceRegion& in) {
  DeviationOrder::Region region;
  region.name = in.region();
  runtime::Refusals refusals;
  if (in.has_minimum_in_part_mm()) {
    const auto corner = runtime::FromProto(field + ".minimum_in_part_mm", in.minimum_in_part_mm());
    refusals.Add(corner.status());
    refusals.Add(CheckCorner(field + ".minimum_in_part_mm", corner));
    if (corner.ok()) region.region.minimum_mm = *corner;
  }
  if (in.has_maximum_in_part_mm()) {
    const auto corner = runtime::FromProto(field + ".maximum_in_part_mm", in.maximum_in_part_mm());
    refusals.Add(corner.status());
    refusals.Add(CheckCorner(field + ".maximum_in_part_mm", corner));
    if (corner.ok()) region.region.maximum_mm = *corner;
  }
  const auto &low = region.region.minimum_mm, &high = region.region.maximum_mm;
  if (low && high && !(low->array() < high->array()).all())
    refusals.Add(
        runtime::Refuse(field + ".maximum_in_part_mm", "not above minimum_in_part_mm", "each coordinate above it"));
  if (in.has_facing_in_part()) {
    const auto facing = runtime::FromProto(field + ".facing_in_part", in.facing_in_part());
    refusals.Add(facing.status());
    if (facing.ok()) region.region.facing = *facing;
  }
  if (in.has_facing_within_deg()) {
    if (!in.has_facing_in_part())
      refusals.Add(runtime::Refuse(field + ".facing_within_deg", in.facing_within_deg(), "facing_in_part with it"));
    if (!(in.facing_within_deg() > 0 && in.facing_within_deg() <= 180))
      refusals.Add(runtime::Refuse(field + ".facing_within_deg", in.facing_within_deg(), "more than 0, at most 180"));
    region.region.facing_within_rad = in.facing_within_deg() * runtime::kRadPerDeg;
  }
  if (!in.has_minimum_in_part_mm() && !in.has_maximum_in_part_mm() && !in.has_facing_in_part())
    refusals.Add(runtime::Refuse(field, "not bounded", "a corner of its box or facing_in_part"));
  if (!refusals.status().ok()) return refusals.status();
  return region;
}

absl::StatusOr<DeviationOrder> OrderOf(const v1::MapDeviationRequest& request) {
  DeviationOrder order;
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("registration", "registrations", request.registration()).status());
  if (request.has_patch_mm()) order.patch_mm = request.patch_mm();
  if (!(order.patch_mm >= metrology::kLeastPatch_mm && order.patch_mm <= metrology::kGreatestPatch_mm))
    refusals.Add(runtime::Refuse("patch_mm", order.patch_mm, "0.1 to 20"));
  std::set<std::string> regions, characteristics;
  for (int i = 0; i < request.regions_size(); ++i) {
    refusals.Add(CheckCalled(At("regions", i) + ".region", request.regions(i).region(), &regions));
    auto region = KernelRegionOf(At("regions", i), request.regions(i));
    refusals.Add(region.status());
    if (region.ok()) order.regions.push_back(*std::move(region));
  }
  const bool known = order.regions.size() == static_cast<std::size_t>(request.regions_size());
  for (int i = 0; known && i < request.profiles_size(); ++i) {
    refusals.Add(
        CheckCalled(At("profiles", i) + ".characteristic", request.profiles(i).characteristic(), &characteristics));
    auto profile = ProfileOf(At("profiles", i), request.profiles(i), order.regions);
    refusals.Add(profile.status());
    if (profile.ok()) order.profiles.push_back(*std::move(profile));
  }
  order.without_cloud = request.without_cloud();
  if (!refusals.status().ok()) return refusals.status();
  return order;
}

absl::StatusOr<std::vector<std::vector<std::uint32_t>>> PatchesOf(const DeviationOrder& order,
                                                                  const metrology::SurfacePatches& patches) {
  std::vector<std::vector<std::uint32_t>> of = {patches.In({})};
  for (std::size_t i = 0; i < order.regions.size(); ++i) {
    of.push_back(patches.In(order.regions[i].region));
    if (of.back().empty())
      return runtime::Refuse(At("regions", static_cast<int>(i)), order.regions[i].name,
                             "a region with a patch of the part's surface");
  }
  return of;
}

}  // namespace sixpoint::inspection
