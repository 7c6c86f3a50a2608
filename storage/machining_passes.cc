#include "storage/machining_passes.h"

#include <utility>

#include "storage/blank_patch_columns.h"
#include "storage/children.h"
#include "storage/each_row.h"
#include "storage/one_read.h"
#include "storage/postgres_results.h"
#include "storage/scan_keys.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_PASS_COLUMNS                                                                                          \
  "pass_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, "                     \
  "sensor_calibration_id, rotation_calibration_id, method, correction_id, reconstruction_id, number, outcome, "        \
  "remark, taken_count, far_off_count, shapeless_count, patch_count, patches_sha256, requested_by, software_version, " \
  "computed_on, greatest_rest_mm"
constexpr char kInsertPass[] =
    "INSERT INTO machining_passes (" SIXPOINT_PASS_COLUMNS
    ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, "
    "$23, $24)";
#define SIXPOINT_SELECT_PASSES                                                                \
  "SELECT " SIXPOINT_PASS_COLUMNS                                                             \
  ", record_sequence, recorded_at, name_of(requested_by), entry_order, entry_operation FROM " \
  "machining_passes JOIN recorded r ON r.record_id = pass_id WHERE "
constexpr char kSelectPass[] = SIXPOINT_SELECT_PASSES "pass_id = $1";
constexpr char kListPasses[] = SIXPOINT_SELECT_PASSES SIXPOINT_RESULT_FILTER(
    "machining_passes", "machining_pass") "AND ($10 = '' OR outcome = $10) " SIXPOINT_NEWEST_FIRST "LIMIT $11";
#undef SIXPOINT_SELECT_PASSES
#undef SIXPOINT_PASS_COLUMNS
constexpr char kInsertPassScans[] =
    "INSERT INTO machining_pass_scans (pass_id, position_index, scan_key) "
    "SELECT $1::uuid, (position - 1)::integer, " SIXPOINT_SCAN_KEY(
        "scan") " FROM unnest($2::text[]) WITH ORDINALITY AS scans (scan, position)";
constexpr char kSelectPassScans[] = "SELECT pass_id, " SIXPOINT_SCAN_ID(
    "scan_key") " FROM machining_pass_scans WHERE pass_id = ANY ($1::uuid[]) ORDER BY pass_id, position_index";
constexpr char kInsertPassRegion[] =
    "INSERT INTO machining_pass_regions (pass_id, position_index, region, patch_count, seen_part, mean_rest_um, "
    "least_rest_um, greatest_rest_um, least_lower_spare_um, least_upper_spare_um, offset_um, deflection_share) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12)";
constexpr char kSelectPassRegions[] =
    "SELECT pass_id, region, patch_count, seen_part, mean_rest_um, least_rest_um, greatest_rest_um, "
    "least_lower_spare_um, least_upper_spare_um, offset_um, deflection_share FROM machining_pass_regions "
    "WHERE pass_id = ANY ($1::uuid[]) ORDER BY pass_id, position_index";
constexpr char kInsertPassPatches[] =
    "INSERT INTO machining_pass_patches (pass_id, points_in_part_mm, normals_in_part, expanded_uncertainties_um, "
    "stock_um, regions) VALUES ($1, $2, $3, $4, $5, $6::double precision[]::integer[])";
constexpr char kSelectPassPatches[] =
    "SELECT " SIXPOINT_PATCH_COLUMNS " FROM machining_pass_patches WHERE pass_id = $1";

Params PassParams(const MachiningPassRow& row) {
  Params params;
  params.Uuid(row.pass_id).Text(row.blade_serial).Uuid(row.registration_id).Text(row.machine_id);
  params.Int(row.machine_revision).Text(row.part_id).Int(row.part_revision).Uuid(row.sensor_calibration_id);
  params.Uuid(row.rotation_calibration_id).Text(row.method).Uuid(row.correction_id).Uuid(row.reconstruction_id);
  params.Int(row.number).Text(row.outcome).Text(row.remark).Int(row.taken_count).Int(row.far_off_count);
  params.Int(row.shapeless_count).Int(row.patch_count).Digest(row.patches_sha256);
  return params.Text(row.requested_by)
      .Text(row.software_version)
      .Text(row.computed_on)
      .OptionalReal(row.greatest_rest_mm);
}

MachiningPassRow ReadPass(const Rows& rows, int row) {
  MachiningPassRow found;
  found.pass_id = rows.Text(row, 0);
  found.blade_serial = rows.Text(row, 1);
  found.registration_id = rows.Text(row, 2);
  found.machine_id = rows.Text(row, 3);
  found.machine_revision = static_cast<int>(rows.Int(row, 4));
  found.part_id = rows.Text(row, 5);
  found.part_revision = static_cast<int>(rows.Int(row, 6));
  found.sensor_calibration_id = rows.Text(row, 7);
  found.rotation_calibration_id = rows.Text(row, 8);
  found.method = rows.Text(row, 9);
  found.correction_id = rows.Text(row, 10);
  found.reconstruction_id = rows.Text(row, 11);
  found.number = static_cast<int>(rows.Int(row, 12));
  found.outcome = rows.Text(row, 13);
  found.remark = rows.Text(row, 14);
  found.taken_count = rows.Int(row, 15);
  found.far_off_count = rows.Int(row, 16);
  found.shapeless_count = rows.Int(row, 17);
  found.patch_count = static_cast<int>(rows.Int(row, 18));
  found.patches_sha256 = rows.Digest(row, 19);
  found.software_version = rows.Text(row, 21);
  found.computed_on = rows.Text(row, 22);
  found.greatest_rest_mm = rows.OptionalReal(row, 23);
  found.recorded = {rows.Int(row, 24), rows.Time(row, 25)};
  found.requested_by = rows.Text(row, 26);
  found.work_order = rows.OptionalText(row, 27);
  found.operation = rows.OptionalText(row, 28);
  return found;
}

Params MachinedRegionParams(const std::string& id, std::size_t position, const MachinedRegionRow& region) {
  Params params;
  params.Uuid(id).Int(static_cast<std::int64_t>(position)).Text(region.region).Int(region.patch_count);
  params.Real(region.seen_part).OptionalReal(region.mean_rest_um).OptionalReal(region.least_rest_um);
  params.OptionalReal(region.greatest_rest_um).OptionalReal(region.least_lower_spare_um);
  params.OptionalReal(region.least_upper_spare_um).OptionalReal(region.offset_um);
  return params.OptionalReal(region.deflection_share);
}

MachinedRegionRow ReadMachinedRegion(const Rows& rows, int row) {
  return {rows.Text(row, 1),         static_cast<int>(rows.Int(row, 2)), rows.Real(row, 3),
          rows.OptionalReal(row, 4), rows.OptionalReal(row, 5),          rows.OptionalReal(row, 6),
          rows.OptionalReal(row, 7), rows.OptionalReal(row, 8),          rows.OptionalReal(row, 9),
          rows.OptionalReal(row, 10)};
}

absl::StatusOr<std::vector<MachiningPassRow>> ReadPasses(Transaction& transaction, const char* sql,
                                                         const Params& params) {
  auto all = AllRows(transaction, sql, params, ReadPass);
  if (!all.ok() || all->empty()) return all;
  const ParentRows<MachiningPassRow> parents(&*all, &MachiningPassRow::pass_id);
  const Params ids = Params().Uuids(parents.ids());
  absl::Status read = parents.Add(
      transaction.Execute(kSelectPassScans, ids),
      [](MachiningPassRow& parent, const Rows& scan, int row) { parent.scan_ids.push_back(scan.Text(row, 1)); });
  if (read.ok())
    read = parents.Add(transaction.Execute(kSelectPassRegions, ids),
                       [](MachiningPassRow& parent, const Rows& region, int row) {
                         parent.regions.push_back(ReadMachinedRegion(region, row));
                       });
  if (!read.ok()) return read;
  return all;
}

absl::StatusOr<std::optional<MachiningPassRow>> FindPass(Transaction& transaction, const std::string& id) {
  return FirstOf(ReadPasses(transaction, kSelectPass, Params().Uuid(id)));
}

absl::StatusOr<std::vector<MachiningPassRow>> ListPasses(Transaction& transaction, const MachiningPassFilter& filter,
                                                         std::int64_t before_sequence, int limit) {
  absl::StatusOr<Params> params = FilterParams(transaction, before_sequence, filter);
  if (!params.ok()) return params.status();
  return ReadPasses(transaction, kListPasses, params->Text(filter.outcome).Int(limit));
}

using PassResults = PostgresResults<MachiningPassRow, MachiningPassFilter, MachiningPassStore>;

class PostgresMachiningPasses final : public PassResults {
 public:
  using PassResults::PassResults;

  absl::StatusOr<std::optional<BlankPatchesRow>> Patches(const std::string& pass_id, Deadline deadline) const override {
    return OneRead(database(), deadline, [&](Transaction& t) { return FindPatches(t, kSelectPassPatches, pass_id); });
  }
};

}  // namespace

absl::StatusOr<Recorded> InsertMachiningPass(Transaction& transaction, const MachiningPassRow& pass,
                                             const RecordEntry& entry) {
  absl::Status status = transaction.Execute(kInsertPass, PassParams(pass)).status();
  if (status.ok())
    status = transaction.Execute(kInsertPassScans, Params().Uuid(pass.pass_id).Texts(pass.scan_ids)).status();
  for (std::size_t i = 0; status.ok() && i < pass.regions.size(); ++i)
    status = transaction.Execute(kInsertPassRegion, MachinedRegionParams(pass.pass_id, i, pass.regions[i])).status();
  if (status.ok()) status = InsertPatches(transaction, kInsertPassPatches, pass.pass_id, pass.patches);
  if (!status.ok()) return status;
  return AppendRecord(transaction, pass.pass_id, entry);
}

std::shared_ptr<MachiningPassStore> MachiningPassesIn(Database* database) {
  return std::make_shared<PostgresMachiningPasses>(database,
                                                   PassResults::Statements{InsertMachiningPass, FindPass, ListPasses});
}

}  // namespace sixpoint::storage
