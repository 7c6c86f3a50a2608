#include "services/inspection/deviation_rows.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "services/clients/error_sources.h"
#include "services/clients/registered_row.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/little_endian.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/row_geometry.h"
#include "services/runtime/surface_where.h"
#include "services/runtime/units.h"
#include "storage/blobs.h"

namespace sixpoint::inspection {
namespace {

constexpr std::size_t kMostAreas = 100;
constexpr char kRule[] =
    "ISO 14253-1 patch by patch: conform where the mean and its U lie within the limits everywhere and enough was "
    "seen, not conform where one "
    "patch is beyond a limit by more than its U; U: 95 %";

storage::DeviationPatchRow PatchRowOf(const metrology::DeviationField& field, std::uint32_t patch, double mean_mm,
                                      double expanded_uncertainty_mm) {
  return {static_cast<int>(patch), runtime::kUmPerMm * mean_mm, runtime::kUmPerMm * expanded_uncertainty_mm,
          runtime::ThreeOf(field.surface->patches()[patch].centre_mm)};
}

storage::DeviationRegionRow RegionRowOf(const metrology::DeviationField& field,
                                        const metrology::DeviationStatistics& statistics) {
  storage::DeviationRegionRow row;
  row.area_mm2 = statistics.area_mm2;
  row.seen_area_mm2 = statistics.seen_area_mm2;
  row.point_count = statistics.point_count;
  if (!statistics.values) return row;
  const metrology::DeviationStatistics::Values& values = *statistics.values;
  const auto patch = [&](std::uint32_t p) {
    return PatchRowOf(field, p, *field.patches[p].mean_mm, field.patches[p].expanded_uncertainty_mm);
  };
  row.values = storage::DeviationRegionRow::Values{runtime::kUmPerMm * values.mean_mm,
                                                   runtime::kUmPerMm * values.rms_mm,
                                                   runtime::kUmPerMm * values.p05_mm,
                                                   runtime::kUmPerMm * values.p50_mm,
                                                   runtime::kUmPerMm * values.p95_mm,
                                                   patch(values.lowest),
                                                   patch(values.highest)};
  return row;
}

void SetBounds(const DeviationOrder::Region& region, storage::DeviationRegionRow* row) {
  row->region = region.name;
  if (region.region.minimum_mm) row->minimum_in_part_mm = runtime::ListOf(*region.region.minimum_mm);
  if (region.region.maximum_mm) row->maximum_in_part_mm = runtime::ListOf(*region.region.maximum_mm);
  if (!region.region.facing) return;
  row->facing_in_part = runtime::ListOf(*region.region.facing);
  row->facing_within_deg = region.region.facing_within_rad / runtime::kRadPerDeg;
}

storage::DeviationProfileRow ProfileRowOf(const metrology::DeviationField& field, const DeviationOrder& order,
                                          const DeviationOrder::Profile& profile,
                                          const std::vector<std::uint32_t>& patches,
                                          const metrology::ProfileFinding& finding) {
  storage::DeviationProfileRow row;
  row.characteristic = profile.characteristic;
  if (profile.region > 0) row.region = order.regions[profile.region - 1].name;
  const bool of_form = profile.tolerance.zone == metrology::ProfileZone::kForm;
  row.zone = of_form ? "FORM" : "FORM_AND_LOCATION";
  row.lower_mm = profile.tolerance.lower_mm;
  row.upper_mm = profile.tolerance.upper_mm;
  row.least_coverage = profile.tolerance.least_coverage;
  row.rule = profile.rule;
  row.verdict = TextOf(finding.verdict);
  row.reason = finding.reason;
  row.coverage = finding.coverage;
  row.out_mm2 = finding.out_mm2;
  row.undecided_mm2 = finding.undecided_mm2;
  row.area_count = static_cast<int>(finding.areas.size());
  if (of_form) row.motion.assign(finding.motion.data(), finding.motion.data() + finding.motion.size());
  const auto in_zone = [&](std::size_t i) {
    return PatchRowOf(field, patches[i], finding.deviations_mm[i], finding.expanded_uncertainties_mm[i]);
  };
  if (finding.lowest) row.lowest = in_zone(*finding.lowest);
  if (finding.highest) row.highest = in_zone(*finding.highest);
  for (const metrology::ProfileArea& area : finding.areas) {
    if (row.areas.size() == kMostAreas) break;
    row.areas.push_back({area.above, area.area_mm2, static_cast<int>(area.patch_count),
                         PatchRowOf(field, area.worst, area.worst_mm, area.worst_expanded_uncertainty_mm),
                         runtime::ThreeOf(area.minimum_mm), runtime::ThreeOf(area.maximum_mm)});
  }
  return row;
}

storage::DeviationPatchesRow PatchesRowOf(const metrology::DeviationField& field) {
  storage::DeviationPatchesRow row;
  const double not_seen = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t p = 0; p < field.patches.size(); ++p) {
    const metrology::SurfacePatch& patch = field.surface->patches()[p];
    const metrology::PatchDeviation& found = field.patches[p];
    for (int k = 0; k < 3; ++k) {
      row.centres_in_part_mm.push_back(patch.centre_mm[k]);
      row.normals_in_part.push_back(runtime::Short(patch.normal[k]));
    }
    row.areas_mm2.push_back(runtime::Short(patch.area_mm2));
    row.point_counts.push_back(found.point_count);
    row.means_um.push_back(found.mean_mm ? runtime::Short(runtime::kUmPerMm * *found.mean_mm) : not_seen);
    row.expanded_uncertainties_um.push_back(
        found.mean_mm ? runtime::Short(runtime::kUmPerMm * found.expanded_uncertainty_mm) : not_seen);
  }
  return row;
}

std::string DigestOf(const storage::DeviationPatchesRow& patches) {
  std::string bytes;
  runtime::AppendReals(patches.centres_in_part_mm, &bytes);
  runtime::AppendFloats(patches.normals_in_part, &bytes);
  runtime::AppendFloats(patches.areas_mm2, &bytes);
  for (const std::int64_t count : patches.point_counts) runtime::Append<std::uint64_t>(count, &bytes);
  runtime::AppendFloats(patches.means_um, &bytes);
  runtime::AppendFloats(patches.expanded_uncertainties_um, &bytes);
  return storage::Sha256Hex(bytes);
}

void SetCloud(std::vector<DeviationBlock> cloud, storage::DeviationMapRow* row) {
  std::vector<std::string> digests;
  for (DeviationBlock& block : cloud) {
    digests.push_back(storage::Sha256Hex(block.encoded.bytes));
    row->cloud.push_back({block.scan, block.point_count, runtime::kUmPerMm * block.encoded.proven_place_error_mm,
                          runtime::kUmPerMm * block.encoded.proven_deviation_error_mm, digests.back()});
    row->cloud_bytes.push_back(std::move(block.encoded.bytes));
  }
  if (!digests.empty()) row->cloud_sha256 = storage::Sha256OfDigests(digests);
}

void SetFindings(const DeviationOrder& order, const MappedDeviation& mapped, storage::DeviationMapRow* row) {
  const metrology::DeviationField& field = mapped.field;
  row->regions.push_back(RegionRowOf(field, field.whole));
  for (std::size_t i = 0; i < order.regions.size(); ++i) {
    row->regions.push_back(RegionRowOf(field, field.regions[i]));
    SetBounds(order.regions[i], &row->regions.back());
  }
  auto worst = metrology::Verdict::kConform;
  for (std::size_t i = 0; i < order.profiles.size(); ++i) {
    row->profiles.push_back(
        ProfileRowOf(field, order, order.profiles[i], mapped.regions[order.profiles[i].region], mapped.profiles[i]));
    worst = metrology::Worst(worst, mapped.profiles[i].verdict);
  }
  if (!order.profiles.empty()) {
    row->verdict = TextOf(worst);
    row->decision_rule = kRule;
  }
  std::vector<metrology::UncertaintyComponent> usual = metrology::UsualComponents(field);
  for (metrology::UncertaintyComponent& component : usual) component.variance *= runtime::kUmPerMm * runtime::kUmPerMm;
  clients::KeptBudgets kept = clients::Kept({&usual});
  row->budget_sources = std::move(kept.sources);
  row->budget_um = std::move(kept.standard_uncertainties_um.front());
}

std::string SummaryOf(const storage::DeviationMapRow& row) {
  const storage::DeviationRegionRow& whole = row.regions.front();
  nlohmann::json summary = {{"coverage", whole.seen_area_mm2 / whole.area_mm2}, {"rms_um", whole.values->rms_um}};
  if (!row.verdict.empty()) summary["verdict"] = row.verdict;
  return summary.dump();
}

}  // namespace

runtime::Made<storage::DeviationMapRow> RecordOf(const clients::RegisteredBlade& blade, const DeviationOrder& order,
                                                 MappedDeviation mapped) {
  const registration::v1::Registration& registration = blade.registration;
  storage::DeviationMapRow row;
  row.deviation_id = storage::NewUuid();
  clients::SetRegistered(registration, &row);
  row.patch_mm = order.patch_mm;
  row.patch_count = static_cast<int>(mapped.field.patches.size());
  row.compared_count = mapped.field.points.compared;
  row.at_edges_count = mapped.field.points.at_edges;
  row.set_aside_count = mapped.field.points.set_aside;
  row.far_off_count = mapped.field.points.far_off;
  SetFindings(order, mapped, &row);
  row.patches = PatchesRowOf(mapped.field);
  row.patches_sha256 = DigestOf(row.patches);
  SetCloud(std::move(mapped.cloud), &row);
  storage::RecordEntry entry =
      clients::EntryOf("deviation", runtime::NameOf("deviations", row.deviation_id), registration);
  entry.summary_json = SummaryOf(row);
  return {std::move(row), std::move(entry)};
}

metrology::SurfaceRegion BoundsOf(const storage::DeviationRegionRow& row) {
  return runtime::WhereOf<metrology::SurfaceRegion>(row);
}

}  // namespace sixpoint::inspection
