#include "storage/reconstructions.h"

#include <utility>

#include "storage/blank_patch_columns.h"
#include "storage/blobs.h"
#include "storage/children.h"
#include "storage/each_row.h"
#include "storage/one_read.h"
#include "storage/postgres_results.h"
#include "storage/scan_keys.h"
#include "storage/shape_region_columns.h"
#include "storage/three.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_RECONSTRUCTION_COLUMNS                                                                       \
  "reconstruction_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, "  \
  "sensor_calibration_id, rotation_calibration_id, method, of_part_limits, patch_mm, farthest_mm, "           \
  "coarsest_spacing_mm, finest_spacing_mm, blend_mm, coverage_factor, outcome, remark, worst_step_um, "       \
  "worst_kink_deg, taken_count, far_off_count, shapeless_count, patch_count, spacing_mm, control_count, "     \
  "level_count, pass_count, of_any_shape, lacking_um, control_reach_mm, tolerance_at_least_um, "              \
  "tolerance_at_most_um, stock_at_least_um, stock_at_most_um, patches_sha256, lattice_sha256, requested_by, " \
  "software_version, computed_on"
constexpr char kInsertReconstruction[] =
    "INSERT INTO reconstructions (" SIXPOINT_RECONSTRUCTION_COLUMNS
    ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, "
    "$23, $24, $25, $26, $27, $28, $29, $30, $31, $32, $33, $34, $35, $36, $37, $38, $39, $40, $41)";
#define SIXPOINT_SELECT_RECONSTRUCTIONS                                                       \
  "SELECT " SIXPOINT_RECONSTRUCTION_COLUMNS                                                   \
  ", record_sequence, recorded_at, name_of(requested_by), entry_order, entry_operation FROM " \
  "reconstructions JOIN recorded r ON r.record_id = reconstruction_id WHERE "
constexpr char kSelectReconstruction[] = SIXPOINT_SELECT_RECONSTRUCTIONS "reconstruction_id = $1";
constexpr char kListReconstructions[] = SIXPOINT_SELECT_RECONSTRUCTIONS SIXPOINT_RESULT_FILTER(
    "reconstructions", "reconstruction") "AND ($10 = '' OR outcome = $10) " SIXPOINT_NEWEST_FIRST "LIMIT $11";
#undef SIXPOINT_SELECT_RECONSTRUCTIONS
#undef SIXPOINT_RECONSTRUCTION_COLUMNS
constexpr char kInsertReconstructionScans[] =
    "INSERT INTO reconstruction_scans (reconstruction_id, position_index, scan_key) "
    "SELECT $1::uuid, (position - 1)::integer, " SIXPOINT_SCAN_KEY(
        "scan") " FROM unnest($2::text[]) WITH ORDINALITY AS scans (scan, position)";
constexpr char kSelectReconstructionScans[] = "SELECT reconstruction_id, " SIXPOINT_SCAN_ID(
    "scan_key") " FROM reconstruction_scans WHERE reconstruction_id = ANY ($1::uuid[]) ORDER BY reconstruction_id, "
                "position_index";
constexpr char kInsertReconstructionRegion[] =
    "INSERT INTO reconstruction_regions (reconstruction_id, position_index, region, minimum_in_part_mm, "
    "maximum_in_part_mm, facing_in_part, facing_within_deg, kind, allowance_mm, lower_mm, upper_mm, area_mm2, "
    "seen_part, patch_count, least_allowance_um, least_spare_um, greatest_band_use, worst_fixed_um, worst_datum_um) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19)";
constexpr char kSelectReconstructionRegions[] =
    "SELECT reconstruction_id, region, minimum_in_part_mm, maximum_in_part_mm, facing_in_part, facing_within_deg, "
    "kind, allowance_mm, lower_mm, upper_mm, area_mm2, seen_part, patch_count, least_allowance_um, least_spare_um, "
    "greatest_band_use, worst_fixed_um, worst_datum_um FROM reconstruction_regions WHERE reconstruction_id = ANY "
    "($1::uuid[]) ORDER BY reconstruction_id, position_index";
constexpr char kInsertHold[] =
    "INSERT INTO reconstruction_holds (reconstruction_id, position_index, region_index, limit_kind, upper, limit_mm, "
    "share, place_in_part_mm, normal_in_part, patch) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)";
constexpr char kSelectHolds[] =
    "SELECT reconstruction_id, region_index, limit_kind, upper, limit_mm, share, place_in_part_mm, normal_in_part, "
    "patch FROM reconstruction_holds WHERE reconstruction_id = ANY ($1::uuid[]) ORDER BY reconstruction_id, "
    "position_index";
constexpr char kInsertBlankPatches[] =
    "INSERT INTO blank_patches (reconstruction_id, points_in_part_mm, normals_in_part, expanded_uncertainties_um, "
    "stock_um, regions) VALUES ($1, $2, $3, $4, $5, $6::double precision[]::integer[])";
constexpr char kSelectBlankPatches[] =
    "SELECT " SIXPOINT_PATCH_COLUMNS " FROM blank_patches WHERE reconstruction_id = $1";

void AddRelaxation(const std::optional<ShapeProofRow::Relaxation>& relaxation, Params* params) {
  if (relaxation)
    params->Real(relaxation->at_least_um).Real(relaxation->at_most_um);
  else
    params->Null().Null();
}

Params ReconstructionParams(const ReconstructionRow& row) {
  Params params;
  params.Uuid(row.reconstruction_id).Text(row.blade_serial).Uuid(row.registration_id).Text(row.machine_id);
  params.Int(row.machine_revision).Text(row.part_id).Int(row.part_revision).Uuid(row.sensor_calibration_id);
  params.Uuid(row.rotation_calibration_id).Text(row.method).Bool(row.of_part_limits);
  const ReconstructionMethodRow& applied = row.applied;
  params.Real(applied.patch_mm).Real(applied.farthest_mm).Real(applied.coarsest_spacing_mm);
  params.Real(applied.finest_spacing_mm).Real(applied.blend_mm).Real(applied.coverage_factor);
  params.Text(row.outcome).Text(row.remark).OptionalReal(row.worst_step_um).OptionalReal(row.worst_kink_deg);
  params.Int(row.taken_count).Int(row.far_off_count).Int(row.shapeless_count).Int(row.patch_count);
  params.Real(row.spacing_mm).Int(row.control_count).Int(row.level_count).Int(row.pass_count);
  if (row.proof) {
    params.Bool(row.proof->of_any_shape).Real(row.proof->lacking_um).Real(row.proof->control_reach_mm);
    AddRelaxation(row.proof->tolerance, &params);
    AddRelaxation(row.proof->stock, &params);
  } else {
    for (int column = 0; column < 7; ++column) params.Null();
  }
  params.Digest(row.patches_sha256);
  row.lattice_sha256.empty() ? params.Null() : params.Digest(row.lattice_sha256);
  return params.Text(row.requested_by).Text(row.software_version).Text(row.computed_on);
}

std::optional<ShapeProofRow> ReadProof(const Rows& rows, int row, int column) {
  if (rows.IsNull(row, column)) return std::nullopt;
  ShapeProofRow proof{rows.Bool(row, column), rows.Real(row, column + 1), rows.Real(row, column + 2), std::nullopt,
                      std::nullopt};
  if (!rows.IsNull(row, column + 3))
    proof.tolerance = ShapeProofRow::Relaxation{rows.Real(row, column + 3), rows.Real(row, column + 4)};
  if (!rows.IsNull(row, column + 5))
    proof.stock = ShapeProofRow::Relaxation{rows.Real(row, column + 5), rows.Real(row, column + 6)};
  return proof;
}

ReconstructionRow ReadReconstruction(const Rows& rows, int row) {
  ReconstructionRow found;
  found.reconstruction_id = rows.Text(row, 0);
  found.blade_serial = rows.Text(row, 1);
  found.registration_id = rows.Text(row, 2);
  found.machine_id = rows.Text(row, 3);
  found.machine_revision = static_cast<int>(rows.Int(row, 4));
  found.part_id = rows.Text(row, 5);
  found.part_revision = static_cast<int>(rows.Int(row, 6));
  found.sensor_calibration_id = rows.Text(row, 7);
  found.rotation_calibration_id = rows.Text(row, 8);
  found.method = rows.Text(row, 9);
  found.of_part_limits = rows.Bool(row, 10);
  found.applied = {rows.Real(row, 11), rows.Real(row, 12), rows.Real(row, 13),
                   rows.Real(row, 14), rows.Real(row, 15), rows.Real(row, 16)};
  found.outcome = rows.Text(row, 17);
  found.remark = rows.Text(row, 18);
  found.worst_step_um = rows.OptionalReal(row, 19);
  found.worst_kink_deg = rows.OptionalReal(row, 20);
  found.taken_count = rows.Int(row, 21);
  found.far_off_count = rows.Int(row, 22);
  found.shapeless_count = rows.Int(row, 23);
  found.patch_count = static_cast<int>(rows.Int(row, 24));
  found.spacing_mm = rows.Real(row, 25);
  found.control_count = rows.Int(row, 26);
  found.level_count = static_cast<int>(rows.Int(row, 27));
  found.pass_count = static_cast<int>(rows.Int(row, 28));
  found.proof = ReadProof(rows, row, 29);
  found.patches_sha256 = rows.Digest(row, 36);
  if (!rows.IsNull(row, 37)) found.lattice_sha256 = rows.Digest(row, 37);
  found.software_version = rows.Text(row, 39);
  found.computed_on = rows.Text(row, 40);
  found.recorded = {rows.Int(row, 41), rows.Time(row, 42)};
  found.requested_by = rows.Text(row, 43);
  found.work_order = rows.OptionalText(row, 44);
  found.operation = rows.OptionalText(row, 45);
  return found;
}

Params ReconstructionRegionParams(const std::string& id, std::size_t index, const ReconstructionRegionRow& region) {
  Params params;
  params.Uuid(id).Int(static_cast<std::int64_t>(index));
  AddShapeRegion(region.applied, &params);
  params.Real(region.area_mm2).Real(region.seen_part);
  params.Int(region.patch_count).OptionalReal(region.least_allowance_um).OptionalReal(region.least_spare_um);
  return params.Real(region.greatest_band_use).OptionalReal(region.worst_fixed_um).OptionalReal(region.worst_datum_um);
}

ReconstructionRegionRow ReadReconstructionRegion(const Rows& rows, int row) {
  ReconstructionRegionRow region;
  region.applied = ShapeRegionAt(rows, row, 1);
  region.area_mm2 = rows.Real(row, 10);
  region.seen_part = rows.Real(row, 11);
  region.patch_count = static_cast<int>(rows.Int(row, 12));
  region.least_allowance_um = rows.OptionalReal(row, 13);
  region.least_spare_um = rows.OptionalReal(row, 14);
  region.greatest_band_use = rows.Real(row, 15);
  region.worst_fixed_um = rows.OptionalReal(row, 16);
  region.worst_datum_um = rows.OptionalReal(row, 17);
  return region;
}

Params HoldParams(const std::string& id, std::size_t index, const ReconstructionHoldRow& hold) {
  Params params;
  params.Uuid(id).Int(static_cast<std::int64_t>(index)).Int(hold.region_index).Text(hold.limit_kind);
  params.Bool(hold.upper).Real(hold.limit_mm).Real(hold.share).Reals(ListOf(hold.place_in_part_mm));
  params.Reals(ListOf(hold.normal_in_part));
  return params.OptionalInt(hold.patch);
}

ReconstructionHoldRow ReadHold(const Rows& rows, int row) {
  ReconstructionHoldRow hold;
  hold.region_index = static_cast<int>(rows.Int(row, 1));
  hold.limit_kind = rows.Text(row, 2);
  hold.upper = rows.Bool(row, 3);
  hold.limit_mm = rows.Real(row, 4);
  hold.share = rows.Real(row, 5);
  hold.place_in_part_mm = ThreeOf(rows.Reals(row, 6));
  hold.normal_in_part = ThreeOf(rows.Reals(row, 7));
  if (!rows.IsNull(row, 8)) hold.patch = static_cast<int>(rows.Int(row, 8));
  return hold;
}

absl::StatusOr<std::vector<ReconstructionRow>> ReadReconstructions(Transaction& transaction, const char* sql,
                                                                   const Params& params) {
  auto all = AllRows(transaction, sql, params, ReadReconstruction);
  if (!all.ok() || all->empty()) return all;
  const ParentRows<ReconstructionRow> parents(&*all, &ReconstructionRow::reconstruction_id);
  const Params ids = Params().Uuids(parents.ids());
  absl::Status read = parents.Add(
      transaction.Execute(kSelectReconstructionScans, ids),
      [](ReconstructionRow& parent, const Rows& scan, int row) { parent.scan_ids.push_back(scan.Text(row, 1)); });
  if (read.ok())
    read = parents.Add(transaction.Execute(kSelectReconstructionRegions, ids),
                       [](ReconstructionRow& parent, const Rows& region, int row) {
                         parent.regions.push_back(ReadReconstructionRegion(region, row));
                       });
  if (read.ok())
    read = parents.Add(
        transaction.Execute(kSelectHolds, ids),
        [](ReconstructionRow& parent, const Rows& hold, int row) { parent.holds.push_back(ReadHold(hold, row)); });
  if (!read.ok()) return read;
  return all;
}

absl::StatusOr<std::optional<ReconstructionRow>> FindReconstruction(Transaction& transaction, const std::string& id) {
  return FirstOf(ReadReconstructions(transaction, kSelectReconstruction, Params().Uuid(id)));
}

absl::StatusOr<std::vector<ReconstructionRow>> ListReconstructions(Transaction& transaction,
                                                                   const ReconstructionFilter& filter,
                                                                   std::int64_t before_sequence, int limit) {
  absl::StatusOr<Params> params = FilterParams(transaction, before_sequence, filter);
  if (!params.ok()) return params.status();
  return ReadReconstructions(transaction, kListReconstructions, params->Text(filter.outcome).Int(limit));
}

// Before the row that names it.
absl::Status PutLattice(Transaction& transaction, const ReconstructionRow& row) {
  if (row.lattice_sha256.empty()) return absl::OkStatus();
  const absl::StatusOr<std::string> put = PutBlob(transaction, row.lattice);
  if (!put.ok()) return put.status();
  if (*put == row.lattice_sha256) return absl::OkStatus();
  return absl::InternalError("lattice: " + *put + ", want the digest " + row.lattice_sha256);
}

using ReconstructionResults = PostgresResults<ReconstructionRow, ReconstructionFilter, ReconstructionStore>;

class PostgresReconstructions final : public ReconstructionResults {
 public:
  using ReconstructionResults::ReconstructionResults;

  absl::StatusOr<std::optional<BlankPatchesRow>> Patches(const std::string& reconstruction_id,
                                                         Deadline deadline) const override {
    return OneRead(database(), deadline,
                   [&](Transaction& t) { return FindPatches(t, kSelectBlankPatches, reconstruction_id); });
  }
  absl::StatusOr<std::string> Lattice(const std::string& lattice_sha256, Deadline deadline) const override {
    return OneRead(database(), deadline, [&](Transaction& t) { return GetBlob(t, lattice_sha256); });
  }
};

}  // namespace

absl::StatusOr<Recorded> InsertReconstruction(Transaction& transaction, const ReconstructionRow& reconstruction,
                                              const RecordEntry& entry) {
  const std::string& id = reconstruction.reconstruction_id;
  absl::Status status = PutLattice(transaction, reconstruction);
  if (status.ok()) status = transaction.Execute(kInsertReconstruction, ReconstructionParams(reconstruction)).status();
  if (status.ok())
    status = transaction.Execute(kInsertReconstructionScans, Params().Uuid(id).Texts(reconstruction.scan_ids)).status();
  for (std::size_t i = 0; status.ok() && i < reconstruction.regions.size(); ++i)
    status =
        transaction.Execute(kInsertReconstructionRegion, ReconstructionRegionParams(id, i, reconstruction.regions[i]))
            .status();
  for (std::size_t i = 0; status.ok() && i < reconstruction.holds.size(); ++i)
    status = transaction.Execute(kInsertHold, HoldParams(id, i, reconstruction.holds[i])).status();
  if (status.ok()) status = InsertPatches(transaction, kInsertBlankPatches, id, reconstruction.patches);
  if (!status.ok()) return status;
  return AppendRecord(transaction, id, entry);
}

std::shared_ptr<ReconstructionStore> ReconstructionsIn(Database* database) {
  return std::make_shared<PostgresReconstructions>(
      database, ReconstructionResults::Statements{InsertReconstruction, FindReconstruction, ListReconstructions});
}

}  // namespace sixpoint::storage
