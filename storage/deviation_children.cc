#include "storage/deviation_children.h"

#include <array>
#include <utility>

#include "storage/optional_reals.h"
#include "storage/three.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertDeviationRegion[] =
    "INSERT INTO deviation_regions (deviation_id, position_index, region, minimum_in_part_mm, maximum_in_part_mm, "
    "facing_in_part, facing_within_deg, area_mm2, seen_area_mm2, point_count, mean_um, rms_um, p05_um, p50_um, p95_um, "
    "lowest_patch, lowest_um, lowest_expanded_uncertainty_um, lowest_in_part_mm, highest_patch, highest_um, "
    "highest_expanded_uncertainty_um, highest_in_part_mm) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, "
    "$13, "
    "$14, $15, $16, $17, $18, $19, $20, $21, $22, $23)";
constexpr char kSelectDeviationRegions[] =
    "SELECT deviation_id, region, minimum_in_part_mm, maximum_in_part_mm, facing_in_part, facing_within_deg, area_mm2, "
    "seen_area_mm2, point_count, mean_um, rms_um, p05_um, p50_um, p95_um, lowest_patch, lowest_um, "
    "lowest_expanded_uncertainty_um, lowest_in_part_mm, highest_patch, highest_um, highest_expanded_uncertainty_um, "
    "highest_in_part_mm FROM deviation_regions WHERE deviation_id = ANY ($1::uuid[]) ORDER BY deviation_id, "
    "position_index";
constexpr char kInsertProfile[] =
    "INSERT INTO deviation_profiles (deviation_id, position_index, characteristic, region, zone, lower_mm, upper_mm, "
    "least_coverage, verdict, reason, coverage, out_mm2, undecided_mm2, area_count, motion, lowest_patch, lowest_um, "
    "lowest_expanded_uncertainty_um, lowest_in_part_mm, highest_patch, highest_um, highest_expanded_uncertainty_um, "
    "highest_in_part_mm, decision_rule, decision_rule_edition, guard_factor) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, "
    "$9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, $23, $24, $25, $26)";
constexpr char kSelectProfiles[] =
    "SELECT deviation_id, characteristic, region, zone, lower_mm, upper_mm, least_coverage, verdict, reason, coverage, "
    "out_mm2, undecided_mm2, area_count, motion, lowest_patch, lowest_um, lowest_expanded_uncertainty_um, "
    "lowest_in_part_mm, highest_patch, highest_um, highest_expanded_uncertainty_um, highest_in_part_mm, decision_rule, "
    "decision_rule_edition, guard_factor FROM deviation_profiles WHERE deviation_id = ANY ($1::uuid[]) ORDER BY "
    "deviation_id, position_index";
// Columns of numbers, an area each: kAreaNumbers.
constexpr char kInsertAreas[] =
    "INSERT INTO deviation_profile_areas (deviation_id, profile_index, position_index, above, area_mm2, patch_count, "
    "worst_patch, worst_um, worst_expanded_uncertainty_um, worst_in_part_mm, minimum_in_part_mm, maximum_in_part_mm) "
    "SELECT $1::uuid, $2::integer, (position - 1)::integer, above = 1, area, patches::integer, patch::integer, worst, "
    "uncertainty, ARRAY[x, y, z], ARRAY[low_x, low_y, low_z], ARRAY[high_x, high_y, high_z] "
    "FROM unnest($3::double precision[], $4::double precision[], $5::double precision[], $6::double precision[], "
    "$7::double precision[], $8::double precision[], $9::double precision[], $10::double precision[], "
    "$11::double precision[], $12::double precision[], $13::double precision[], $14::double precision[], "
    "$15::double precision[], $16::double precision[], $17::double precision[]) WITH ORDINALITY AS areas (above, area, "
    "patches, patch, worst, uncertainty, x, y, z, low_x, low_y, low_z, high_x, high_y, high_z, position)";
constexpr std::size_t kAreaNumbers = 15;
constexpr char kSelectAreas[] =
    "SELECT deviation_id, profile_index, above, area_mm2, patch_count, worst_patch, worst_um, "
    "worst_expanded_uncertainty_um, worst_in_part_mm, minimum_in_part_mm, maximum_in_part_mm "
    "FROM deviation_profile_areas WHERE deviation_id = ANY ($1::uuid[]) ORDER BY deviation_id, profile_index, "
    "position_index";

void AddPatch(const DeviationPatchRow& patch, Params* params) {
  params->Int(patch.patch).Real(patch.mean_um).Real(patch.expanded_uncertainty_um);
  params->Reals({patch.centre_in_part_mm.begin(), patch.centre_in_part_mm.end()});
}

// Its number, mean, uncertainty and place, from that column on.
DeviationPatchRow PatchAt(const Rows& rows, int row, int column) {
  return {static_cast<int>(rows.Int(row, column)), rows.Real(row, column + 1), rows.Real(row, column + 2),
          ThreeOf(rows.Reals(row, column + 3))};
}

Params DeviationRegionParams(const std::string& deviation_id, std::size_t index, const DeviationRegionRow& region) {
  Params params;
  params.Uuid(deviation_id).Int(static_cast<std::int64_t>(index)).Text(region.region);
  for (const std::vector<double>* three :
       {&region.minimum_in_part_mm, &region.maximum_in_part_mm, &region.facing_in_part})
    AddOptionalReals(*three, &params);
  params.OptionalReal(region.facing_within_deg).Real(region.area_mm2).Real(region.seen_area_mm2);
  params.Int(region.point_count);
  if (!region.values) {
    for (int column = 0; column < 13; ++column) params.Null();
    return params;
  }
  const DeviationRegionRow::Values& values = *region.values;
  params.Real(values.mean_um).Real(values.rms_um).Real(values.p05_um).Real(values.p50_um).Real(values.p95_um);
  AddPatch(values.lowest, &params);
  AddPatch(values.highest, &params);
  return params;
}

DeviationRegionRow ReadDeviationRegion(const Rows& rows, int row) {
  DeviationRegionRow region;
  region.region = rows.Text(row, 1);
  region.minimum_in_part_mm = OptionalRealsAt(rows, row, 2);
  region.maximum_in_part_mm = OptionalRealsAt(rows, row, 3);
  region.facing_in_part = OptionalRealsAt(rows, row, 4);
  region.facing_within_deg = rows.OptionalReal(row, 5);
  region.area_mm2 = rows.Real(row, 6);
  region.seen_area_mm2 = rows.Real(row, 7);
  region.point_count = rows.Int(row, 8);
  if (rows.IsNull(row, 9)) return region;
  region.values =
      DeviationRegionRow::Values{rows.Real(row, 9),  rows.Real(row, 10),     rows.Real(row, 11),    rows.Real(row, 12),
                                 rows.Real(row, 13), PatchAt(rows, row, 14), PatchAt(rows, row, 18)};
  return region;
}

Params ProfileParams(const std::string& deviation_id, std::size_t index, const DeviationProfileRow& profile) {
  Params params;
  params.Uuid(deviation_id).Int(static_cast<std::int64_t>(index)).Text(profile.characteristic).Text(profile.region);
  params.Text(profile.zone).Real(profile.lower_mm).Real(profile.upper_mm).Real(profile.least_coverage);
  params.Text(profile.verdict).Text(profile.reason).Real(profile.coverage).Real(profile.out_mm2);
  params.Real(profile.undecided_mm2).Int(profile.area_count);
  AddOptionalReals(profile.motion, &params);
  for (const std::optional<DeviationPatchRow>* patch : {&profile.lowest, &profile.highest}) {
    if (patch->has_value())
      AddPatch(**patch, &params);
    else
      params.Null().Null().Null().Null();
  }
  Add(profile.rule, &params);
  return params;
}

DeviationProfileRow ReadProfile(const Rows& rows, int row) {
  DeviationProfileRow profile;
  profile.characteristic = rows.Text(row, 1);
  profile.region = rows.Text(row, 2);
  profile.zone = rows.Text(row, 3);
  profile.lower_mm = rows.Real(row, 4);
  profile.upper_mm = rows.Real(row, 5);
  profile.least_coverage = rows.Real(row, 6);
  profile.verdict = rows.Text(row, 7);
  profile.reason = rows.Text(row, 8);
  profile.coverage = rows.Real(row, 9);
  profile.out_mm2 = rows.Real(row, 10);
  profile.undecided_mm2 = rows.Real(row, 11);
  profile.area_count = static_cast<int>(rows.Int(row, 12));
  profile.motion = OptionalRealsAt(rows, row, 13);
  if (!rows.IsNull(row, 14)) profile.lowest = PatchAt(rows, row, 14);
  if (!rows.IsNull(row, 18)) profile.highest = PatchAt(rows, row, 18);
  profile.rule = DecisionRuleAt(rows, row, 22);
  return profile;
}

Params AreasParams(const std::string& deviation_id, std::size_t profile,
                   const std::vector<DeviationProfileAreaRow>& areas) {
  std::array<std::vector<double>, kAreaNumbers> columns;
  for (const DeviationProfileAreaRow& area : areas) {
    const std::array<double, kAreaNumbers> numbers = {area.above ? 1.0 : 0.0,
                                                      area.area_mm2,
                                                      static_cast<double>(area.patch_count),
                                                      static_cast<double>(area.worst.patch),
                                                      area.worst.mean_um,
                                                      area.worst.expanded_uncertainty_um,
                                                      area.worst.centre_in_part_mm[0],
                                                      area.worst.centre_in_part_mm[1],
                                                      area.worst.centre_in_part_mm[2],
                                                      area.minimum_in_part_mm[0],
                                                      area.minimum_in_part_mm[1],
                                                      area.minimum_in_part_mm[2],
                                                      area.maximum_in_part_mm[0],
                                                      area.maximum_in_part_mm[1],
                                                      area.maximum_in_part_mm[2]};
    for (std::size_t k = 0; k < kAreaNumbers; ++k) columns[k].push_back(numbers[k]);
  }
  Params params;
  params.Uuid(deviation_id).Int(static_cast<std::int64_t>(profile));
  for (const std::vector<double>& column : columns) params.Reals(column);
  return params;
}

}  // namespace

absl::Status InsertDeviationChildren(Transaction& transaction, const DeviationMapRow& map) {
  for (std::size_t i = 0; i < map.regions.size(); ++i) {
    const auto inserted =
        transaction.Execute(kInsertDeviationRegion, DeviationRegionParams(map.deviation_id, i, map.regions[i]));
    if (!inserted.ok()) return inserted.status();
  }
  for (std::size_t i = 0; i < map.profiles.size(); ++i) {
    const DeviationProfileRow& profile = map.profiles[i];
    auto inserted = transaction.Execute(kInsertProfile, ProfileParams(map.deviation_id, i, profile));
    if (inserted.ok() && !profile.areas.empty())
      inserted = transaction.Execute(kInsertAreas, AreasParams(map.deviation_id, i, profile.areas));
    if (!inserted.ok()) return inserted.status();
  }
  return absl::OkStatus();
}

absl::Status ReadDeviationChildren(Transaction& transaction, const ParentRows<DeviationMapRow>& maps) {
  const Params ids = Params().Uuids(maps.ids());
  absl::Status read = maps.Add(
      transaction.Execute(kSelectDeviationRegions, ids),
      [](DeviationMapRow& map, const Rows& rows, int row) { map.regions.push_back(ReadDeviationRegion(rows, row)); });
  if (read.ok())
    read = maps.Add(transaction.Execute(kSelectProfiles, ids), [](DeviationMapRow& map, const Rows& rows, int row) {
      map.profiles.push_back(ReadProfile(rows, row));
    });
  if (!read.ok()) return read;
  return maps.Add(transaction.Execute(kSelectAreas, ids), [](DeviationMapRow& map, const Rows& rows, int row) {
    const auto profile = static_cast<std::size_t>(rows.Int(row, 1));
    if (profile >= map.profiles.size()) return;  // its foreign key holds it
    map.profiles[profile].areas.push_back({rows.Bool(row, 2), rows.Real(row, 3), static_cast<int>(rows.Int(row, 4)),
                                           PatchAt(rows, row, 5), ThreeOf(rows.Reals(row, 9)),
                                           ThreeOf(rows.Reals(row, 10))});
  });
}

}  // namespace sixpoint::storage
