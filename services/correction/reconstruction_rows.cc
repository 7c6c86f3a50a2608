#include "services/correction/reconstruction_rows.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "services/clients/registered_row.h"
#include "services/correction/lattice_bytes.h"
#include "services/runtime/little_endian.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/row_geometry.h"
#include "services/runtime/units.h"
#include "storage/blobs.h"

namespace sixpoint::correction {
namespace {

constexpr std::size_t kMostHolds = 100;

std::string WordOf(metrology::LimitKind kind) {
  switch (kind) {
    case metrology::LimitKind::kStock:
      return "STOCK";
    case metrology::LimitKind::kTolerance:
      return "TOLERANCE";
    case metrology::LimitKind::kFixed:
      return "FIXED";
    case metrology::LimitKind::kDatum:
      return "DATUM";
  }
  return "STOCK";
}

std::string WordOf(metrology::ShapeOutcome outcome) {
  switch (outcome) {
    case metrology::ShapeOutcome::kReconstructed:
      return "RECONSTRUCTED";
    case metrology::ShapeOutcome::kInfeasible:
      return "INFEASIBLE";
    case metrology::ShapeOutcome::kNotDetermined:
      return "NOT_DETERMINED";
  }
  return "NOT_DETERMINED";
}

storage::ReconstructionRegionRow RegionRowOf(const storage::ShapeRegionRow& applied,
                                             const metrology::RegionFinding& finding) {
  storage::ReconstructionRegionRow row;
  row.applied = applied;
  row.area_mm2 = finding.area_mm2;
  row.seen_part = finding.seen_part;
  row.patch_count = static_cast<int>(finding.patch_count);
  row.least_allowance_um = runtime::In_um(finding.least_allowance_mm);
  row.least_spare_um = runtime::In_um(finding.least_spare_mm);
  row.greatest_band_use = finding.greatest_band_use;
  row.worst_fixed_um = runtime::In_um(finding.worst_fixed_mm);
  if (applied.kind == "DATUM") row.worst_datum_um = runtime::kUmPerMm * finding.worst_datum_mm;
  return row;
}

std::vector<storage::ReconstructionHoldRow> HoldRowsOf(const std::vector<metrology::HoldingPlace>& places,
                                                       std::size_t region_count) {
  std::vector<storage::ReconstructionHoldRow> rows;
  for (const metrology::HoldingPlace& place : places) {
    if (rows.size() == kMostHolds) break;
    if (place.region >= region_count) continue;
    storage::ReconstructionHoldRow& row = rows.emplace_back();
    row.region_index = static_cast<int>(place.region);
    row.limit_kind = WordOf(place.kind);
    row.upper = place.most;
    row.limit_mm = place.limit_mm;
    row.share = place.share;
    row.place_in_part_mm = runtime::ThreeOf(place.place_mm);
    row.normal_in_part = runtime::ThreeOf(place.normal);
    if (place.patch) row.patch = static_cast<int>(*place.patch);
  }
  return rows;
}

std::optional<storage::ShapeProofRow::Relaxation> RelaxationOf(
    const std::optional<metrology::LeastRelaxation>& relaxation) {
  if (!relaxation) return std::nullopt;
  return storage::ShapeProofRow::Relaxation{runtime::kUmPerMm * relaxation->at_least_mm,
                                            runtime::kUmPerMm * relaxation->at_most_mm};
}

void SetShape(const metrology::Reconstruction& found, storage::ReconstructionRow* row) {
  row->outcome = WordOf(found.outcome);
  row->remark = found.remark;
  row->spacing_mm = found.spacing_mm;
  row->control_count = static_cast<std::int64_t>(found.control_count);
  row->level_count = found.level_count;
  row->pass_count = found.pass_count;
  if (found.deformation) {
    row->worst_step_um = runtime::kUmPerMm * found.worst_step_mm;
    row->worst_kink_deg = runtime::kDegPerRad * found.worst_kink_rad;
    row->lattice = LatticeBytes(*found.deformation);
    row->lattice_sha256 = storage::Sha256Hex(row->lattice);
  }
  if (!found.proof) return;
  const metrology::ShapeProof& proof = *found.proof;
  row->proof = storage::ShapeProofRow{proof.of_any_shape, runtime::kUmPerMm * proof.lacking_mm, proof.control_reach_mm,
                                      RelaxationOf(proof.tolerance), RelaxationOf(proof.stock)};
}

}  // namespace

storage::BlankPatchesRow PatchesRowOf(const std::vector<metrology::BlankPatch>& patches,
                                      const std::vector<std::optional<double>>& stock_mm,
                                      const std::vector<std::size_t>& regions) {
  storage::BlankPatchesRow row;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const metrology::BlankPatch& patch = patches[i];
    for (int k = 0; k < 3; ++k) {
      row.points_in_part_mm.push_back(patch.point_mm[k]);
      row.normals_in_part.push_back(runtime::Short(patch.normal[k]));
    }
    row.expanded_uncertainties_um.push_back(
        runtime::Short(runtime::kUmPerMm * kPatchCoverage * patch.standard_uncertainty_mm));
    row.stock_um.push_back(stock_mm[i] ? runtime::Short(runtime::kUmPerMm * *stock_mm[i])
                                       : std::numeric_limits<double>::quiet_NaN());
    row.regions.push_back(static_cast<std::int64_t>(regions[i]));
  }
  return row;
}

std::string DigestOf(const storage::BlankPatchesRow& patches) {
  std::string bytes;
  runtime::AppendReals(patches.points_in_part_mm, &bytes);
  runtime::AppendFloats(patches.normals_in_part, &bytes);
  runtime::AppendFloats(patches.expanded_uncertainties_um, &bytes);
  runtime::AppendFloats(patches.stock_um, &bytes);
  for (const std::int64_t region : patches.regions)
    runtime::Append<std::uint32_t>(static_cast<std::int32_t>(region), &bytes);
  return storage::Sha256Hex(bytes);
}

runtime::Made<storage::ReconstructionRow> RecordOf(const clients::RegisteredBlade& blade,
                                                   const ReconstructionOrder& order, const AppliedRegions& regions,
                                                   const ReconstructedBlank& made) {
  storage::ReconstructionRow row;
  row.reconstruction_id = storage::NewUuid();
  clients::SetRegistered(blade.registration, &row);
  row.of_part_limits = regions.of_part_limits;
  row.applied = order.method;
  SetShape(made.found, &row);
  row.taken_count = made.counts.taken;
  row.far_off_count = made.counts.far_off;
  row.shapeless_count = made.counts.shapeless;
  row.patch_count = static_cast<int>(made.blank.size());
  for (std::size_t i = 0; i < regions.rows.size(); ++i)
    row.regions.push_back(RegionRowOf(regions.rows[i], made.found.regions.at(i)));
  row.holds = HoldRowsOf(made.found.proof ? made.found.proof->conflicts : made.found.holding, regions.rows.size());
  row.patches = PatchesRowOf(made.blank, made.stock_mm, made.region_of);
  row.patches_sha256 = DigestOf(row.patches);
  storage::RecordEntry entry =
      clients::EntryOf("reconstruction", runtime::NameOf("reconstructions", row.reconstruction_id), blade.registration);
  nlohmann::json summary = {{"outcome", row.outcome}, {"of_part_limits", row.of_part_limits}};
  entry.summary_json = summary.dump();
  return {std::move(row), std::move(entry)};
}

}  // namespace sixpoint::correction
