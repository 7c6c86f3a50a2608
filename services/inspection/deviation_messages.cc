#include "services/inspection/deviation_messages.h"

#include <algorithm>
#include <string>

#include "services/clients/error_sources.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/decision_rule_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/surface_where.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::inspection {
namespace {

void Fill(const storage::DeviationPatchRow& row, v1::PatchDeviation* out) {
  out->set_patch(row.patch);
  runtime::SetPoint(row.centre_in_part_mm, out->mutable_centre_in_part_mm());
  out->set_mean_um(row.mean_um);
  out->set_expanded_uncertainty_um(row.expanded_uncertainty_um);
}

void Fill(const storage::DeviationRegionRow& row, v1::DeviationStatistics* out) {
  out->set_region(row.region);
  out->set_area_mm2(row.area_mm2);
  out->set_seen_area_mm2(row.seen_area_mm2);
  out->set_point_count(row.point_count);
  if (!row.values) return;
  out->set_mean_um(row.values->mean_um);
  out->set_rms_um(row.values->rms_um);
  out->set_p05_um(row.values->p05_um);
  out->set_p50_um(row.values->p50_um);
  out->set_p95_um(row.values->p95_um);
  Fill(row.values->lowest, out->mutable_lowest());
  Fill(row.values->highest, out->mutable_highest());
}

absl::Status Fill(const storage::DeviationProfileRow& row, const std::string& what, v1::ProfileFinding* out) {
  v1::ProfileTolerance& tolerance = *out->mutable_tolerance();
  tolerance.set_characteristic(row.characteristic);
  tolerance.set_region(row.region);
  const auto zone = runtime::StoredEnum<v1::ProfileZone>(row.zone, what);
  if (!zone.ok()) return zone.status();
  tolerance.set_zone(*zone);
  tolerance.set_lower_mm(row.lower_mm);
  tolerance.set_upper_mm(row.upper_mm);
  tolerance.set_least_coverage(row.least_coverage);
  runtime::StoredWords words(what);
  if (!row.rule.kind.empty()) runtime::ToProto(row.rule, &words, tolerance.mutable_decision_rule());
  if (!words.status().ok()) return words.status();
  const auto verdict = VerdictOf(row.verdict, what);
  if (!verdict.ok()) return verdict.status();
  out->set_verdict(*verdict);
  out->set_reason(row.reason);
  out->set_coverage(row.coverage);
  out->set_out_mm2(row.out_mm2);
  out->set_undecided_mm2(row.undecided_mm2);
  out->set_area_count(row.area_count);
  out->mutable_motion()->Add(row.motion.begin(), row.motion.end());
  if (row.lowest) Fill(*row.lowest, out->mutable_lowest());
  if (row.highest) Fill(*row.highest, out->mutable_highest());
  for (const storage::DeviationProfileAreaRow& area_row : row.areas) {
    v1::ProfileArea& area = *out->add_areas();
    area.set_above(area_row.above);
    area.set_area_mm2(area_row.area_mm2);
    area.set_patch_count(area_row.patch_count);
    Fill(area_row.worst, area.mutable_worst());
    runtime::SetPoint(area_row.minimum_in_part_mm, area.mutable_minimum_in_part_mm());
    runtime::SetPoint(area_row.maximum_in_part_mm, area.mutable_maximum_in_part_mm());
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<v1::DeviationMap> ToProto(const storage::DeviationMapRow& row) {
  v1::DeviationMap map;
  const std::string what = "deviation " + row.deviation_id;
  map.set_name(runtime::NameOf("deviations", row.deviation_id));
  map.set_blade(runtime::NameOf("blades", row.blade_serial));
  map.set_registration(runtime::NameOf("registrations", row.registration_id));
  const auto method = runtime::StoredEnum<registration::v1::Method>(row.method, what);
  if (!method.ok()) return method.status();
  map.set_method(*method);
  for (const std::string& scan : row.scan_ids) map.add_scans(runtime::NameOf("scans", scan));
  map.set_patch_mm(row.patch_mm);
  v1::DeviationPoints& points = *map.mutable_points();
  points.set_compared(row.compared_count);
  points.set_at_edges(row.at_edges_count);
  points.set_set_aside(row.set_aside_count);
  points.set_far_off(row.far_off_count);
  for (const storage::DeviationRegionRow& region : row.regions) {
    Fill(region, map.add_statistics());
    if (region.region.empty()) continue;
    v1::SurfaceRegion& asked = *map.add_regions();
    asked.set_region(region.region);
    runtime::SetWhere(region, &asked);
  }
  const auto budget = clients::BudgetOf(map.name(), row.budget_sources, row.budget_um);
  if (!budget.ok()) return budget.status();
  map.mutable_budget()->Add(budget->begin(), budget->end());
  for (const storage::DeviationProfileRow& profile : row.profiles)
    if (absl::Status status = Fill(profile, what, map.add_profiles()); !status.ok()) return status;
  if (!row.verdict.empty()) {
    const auto verdict = VerdictOf(row.verdict, what);
    if (!verdict.ok()) return verdict.status();
    map.set_verdict(*verdict);
  }
  map.set_decision_rule(row.decision_rule);
  map.set_patch_count(row.patch_count);
  map.set_patches_sha256(row.patches_sha256);
  map.set_cloud_sha256(row.cloud_sha256);
  map.set_requested_by(row.requested_by);
  map.set_software_version(row.software_version);
  map.set_computed_on(row.computed_on);
  runtime::ToProto(row.recorded.recorded_at, map.mutable_recorded_at());
  map.set_record_sequence(row.recorded.sequence);
  map.set_work_order(row.work_order);
  map.set_operation(row.operation);
  return map;
}

void LeaveBasic(v1::DeviationMap* map) {
  for (v1::ProfileFinding& profile : *map->mutable_profiles()) profile.clear_areas();
}

v1::DeviationPatches ToProto(const storage::DeviationPatchesRow& patches, std::size_t first, std::size_t count) {
  const std::size_t end = std::min(first + count, patches.areas_mm2.size());
  v1::DeviationPatches out;
  runtime::AddSlice(patches.centres_in_part_mm, 3 * first, 3 * end, out.mutable_centres_in_part_mm());
  runtime::AddSlice(patches.normals_in_part, 3 * first, 3 * end, out.mutable_normals_in_part());
  runtime::AddSlice(patches.areas_mm2, first, end, out.mutable_areas_mm2());
  runtime::AddSlice(patches.point_counts, first, end, out.mutable_point_counts());
  runtime::AddSlice(patches.means_um, first, end, out.mutable_means_um());
  runtime::AddSlice(patches.expanded_uncertainties_um, first, end, out.mutable_expanded_uncertainties_um());
  return out;
}

v1::MapDeviationRequest RequestOf(const v1::DeviationMap& recorded) {
  v1::MapDeviationRequest request;
  request.set_registration(recorded.registration());
  request.set_patch_mm(recorded.patch_mm());
  *request.mutable_regions() = recorded.regions();
  for (const v1::ProfileFinding& profile : recorded.profiles()) *request.add_profiles() = profile.tolerance();
  request.set_without_cloud(recorded.cloud_sha256().empty());
  return request;
}

}  // namespace sixpoint::inspection
