#include "storage/deviations.h"

#include <algorithm>
#include <utility>

#include "storage/blobs.h"
#include "storage/children.h"
#include "storage/deviation_children.h"
#include "storage/each_row.h"
#include "storage/one_read.h"
#include "storage/postgres_results.h"
#include "storage/scan_keys.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_MAP_COLUMNS                                                                                          \
  "deviation_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, "               \
  "sensor_calibration_id, rotation_calibration_id, method, patch_mm, patch_count, compared_count, at_edges_count, "   \
  "set_aside_count, far_off_count, budget_sources, budget_um, verdict, decision_rule, patches_sha256, cloud_sha256, " \
  "requested_by, software_version, computed_on"
constexpr char kInsertMap[] = "INSERT INTO deviation_maps (" SIXPOINT_MAP_COLUMNS
                              ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, "
                              "$18, $19, $20, $21, $22, $23, "
                              "$24, $25)";
#define SIXPOINT_SELECT_MAPS                                                                                      \
  "SELECT " SIXPOINT_MAP_COLUMNS                                                                                  \
  ", record_sequence, recorded_at, name_of(requested_by), entry_order, entry_operation FROM deviation_maps JOIN " \
  "recorded r ON r.record_id = deviation_id WHERE "
constexpr char kSelectMap[] = SIXPOINT_SELECT_MAPS "deviation_id = $1";
constexpr char kListMaps[] = SIXPOINT_SELECT_MAPS SIXPOINT_RESULT_FILTER(
    "deviation_maps", "deviation") "AND ($10 = '' OR verdict = $10) " SIXPOINT_NEWEST_FIRST "LIMIT $11";
#undef SIXPOINT_SELECT_MAPS
#undef SIXPOINT_MAP_COLUMNS
constexpr char kInsertDeviationScans[] =
    "INSERT INTO deviation_map_scans (deviation_id, position_index, scan_key) "
    "SELECT $1::uuid, (position - 1)::integer, " SIXPOINT_SCAN_KEY(
        "scan") " FROM unnest($2::text[]) WITH ORDINALITY AS scans (scan, position)";
constexpr char kSelectDeviationScans[] = "SELECT deviation_id, " SIXPOINT_SCAN_ID(
    "scan_key") " FROM deviation_map_scans WHERE deviation_id = ANY ($1::uuid[]) ORDER BY deviation_id, position_index";
constexpr char kInsertDeviationPatches[] =
    "INSERT INTO deviation_patches (deviation_id, centres_in_part_mm, normals_in_part, areas_mm2, point_counts, "
    "means_um, "
    "expanded_uncertainties_um) VALUES ($1, $2, $3, $4, $5::double precision[]::bigint[], $6, $7)";
constexpr char kSelectDeviationPatches[] =
    "SELECT centres_in_part_mm, normals_in_part, areas_mm2, point_counts, means_um, expanded_uncertainties_um "
    "FROM deviation_patches WHERE deviation_id = $1";
constexpr char kInsertCloudBlock[] =
    "INSERT INTO deviation_cloud_blocks (deviation_id, position_index, scan_index, point_count, proven_place_error_um, "
    "proven_deviation_error_um, blob_sha256) VALUES ($1, $2, $3, $4, $5, $6, $7)";
constexpr char kSelectCloudBlocks[] =
    "SELECT scan_index, point_count, proven_place_error_um, proven_deviation_error_um, blob_sha256 "
    "FROM deviation_cloud_blocks WHERE deviation_id = $1 ORDER BY position_index";

Params MapParams(const DeviationMapRow& map) {
  Params params;
  params.Uuid(map.deviation_id).Text(map.blade_serial).Uuid(map.registration_id).Text(map.machine_id);
  params.Int(map.machine_revision).Text(map.part_id).Int(map.part_revision).Uuid(map.sensor_calibration_id);
  params.Uuid(map.rotation_calibration_id).Text(map.method).Real(map.patch_mm).Int(map.patch_count);
  params.Int(map.compared_count).Int(map.at_edges_count).Int(map.set_aside_count).Int(map.far_off_count);
  params.Texts(map.budget_sources).Reals(map.budget_um).OptionalText(map.verdict).OptionalText(map.decision_rule);
  params.Digest(map.patches_sha256);
  map.cloud_sha256.empty() ? params.Null() : params.Digest(map.cloud_sha256);
  return params.Text(map.requested_by).Text(map.software_version).Text(map.computed_on);
}

DeviationMapRow ReadMap(const Rows& rows, int row) {
  DeviationMapRow map;
  map.deviation_id = rows.Text(row, 0);
  map.blade_serial = rows.Text(row, 1);
  map.registration_id = rows.Text(row, 2);
  map.machine_id = rows.Text(row, 3);
  map.machine_revision = static_cast<int>(rows.Int(row, 4));
  map.part_id = rows.Text(row, 5);
  map.part_revision = static_cast<int>(rows.Int(row, 6));
  map.sensor_calibration_id = rows.Text(row, 7);
  map.rotation_calibration_id = rows.Text(row, 8);
  map.method = rows.Text(row, 9);
  map.patch_mm = rows.Real(row, 10);
  map.patch_count = static_cast<int>(rows.Int(row, 11));
  map.compared_count = rows.Int(row, 12);
  map.at_edges_count = rows.Int(row, 13);
  map.set_aside_count = rows.Int(row, 14);
  map.far_off_count = rows.Int(row, 15);
  map.budget_sources = rows.Texts(row, 16);
  map.budget_um = rows.Reals(row, 17);
  map.verdict = rows.OptionalText(row, 18);
  map.decision_rule = rows.OptionalText(row, 19);
  map.patches_sha256 = rows.Digest(row, 20);
  if (!rows.IsNull(row, 21)) map.cloud_sha256 = rows.Digest(row, 21);
  map.software_version = rows.Text(row, 23);
  map.computed_on = rows.Text(row, 24);
  map.recorded = {rows.Int(row, 25), rows.Time(row, 26)};
  map.requested_by = rows.Text(row, 27);
  map.work_order = rows.OptionalText(row, 28);
  map.operation = rows.OptionalText(row, 29);
  return map;
}

absl::StatusOr<std::vector<DeviationMapRow>> ReadMaps(Transaction& transaction, const char* sql, const Params& params) {
  auto maps = AllRows(transaction, sql, params, ReadMap);
  if (!maps.ok() || maps->empty()) return maps;
  const ParentRows<DeviationMapRow> parents(&*maps, &DeviationMapRow::deviation_id);
  const absl::Status scans =
      parents.Add(transaction.Execute(kSelectDeviationScans, Params().Uuids(parents.ids())),
                  [](DeviationMapRow& map, const Rows& scan, int row) { map.scan_ids.push_back(scan.Text(row, 1)); });
  if (!scans.ok()) return scans;
  if (absl::Status read = ReadDeviationChildren(transaction, parents); !read.ok()) return read;
  return maps;
}

absl::Status InsertDeviationPatches(Transaction& transaction, const std::string& id,
                                    const DeviationPatchesRow& patches) {
  const std::vector<double> counts(patches.point_counts.begin(), patches.point_counts.end());
  Params params;
  params.Uuid(id).Reals(patches.centres_in_part_mm).Reals(patches.normals_in_part).Reals(patches.areas_mm2);
  params.Reals(counts).Reals(patches.means_um).Reals(patches.expanded_uncertainties_um);
  return transaction.Execute(kInsertDeviationPatches, params).status();
}

absl::Status InsertCloud(Transaction& transaction, const DeviationMapRow& map) {
  for (std::size_t i = 0; i < map.cloud.size(); ++i) {
    const DeviationCloudBlockRow& block = map.cloud[i];
    const absl::StatusOr<std::string> put = PutBlob(transaction, map.cloud_bytes[i]);
    if (!put.ok()) return put.status();
    if (*put != block.blob_sha256)
      return absl::InternalError("cloud[" + std::to_string(i) + "]: " + *put + ", want the digest " +
                                 block.blob_sha256);
    Params params;
    params.Uuid(map.deviation_id).Int(static_cast<std::int64_t>(i)).Int(block.scan_index).Int(block.point_count);
    params.Real(block.proven_place_error_um).Real(block.proven_deviation_error_um).Digest(block.blob_sha256);
    if (absl::Status status = transaction.Execute(kInsertCloudBlock, params).status(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::StatusOr<std::optional<DeviationMapRow>> FindMap(Transaction& transaction, const std::string& deviation_id) {
  return FirstOf(ReadMaps(transaction, kSelectMap, Params().Uuid(deviation_id)));
}

absl::StatusOr<std::vector<DeviationMapRow>> ListMaps(Transaction& transaction, const DeviationFilter& filter,
                                                      std::int64_t before_sequence, int limit) {
  absl::StatusOr<Params> params = FilterParams(transaction, before_sequence, filter);
  if (!params.ok()) return params.status();
  return ReadMaps(transaction, kListMaps, params->Text(filter.verdict).Int(limit));
}

absl::StatusOr<std::optional<DeviationPatchesRow>> FindDeviationPatches(Transaction& transaction,
                                                                        const std::string& deviation_id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectDeviationPatches, Params().Uuid(deviation_id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  DeviationPatchesRow patches;
  patches.centres_in_part_mm = rows->Reals(0, 0);
  patches.normals_in_part = rows->Reals(0, 1);
  patches.areas_mm2 = rows->Reals(0, 2);
  for (const double count : rows->Reals(0, 3)) patches.point_counts.push_back(static_cast<std::int64_t>(count));
  patches.means_um = rows->Reals(0, 4);
  patches.expanded_uncertainties_um = rows->Reals(0, 5);
  return rows->Checked(std::optional<DeviationPatchesRow>(std::move(patches)));
}

absl::StatusOr<std::vector<DeviationCloudBlockRow>> FindCloud(Transaction& transaction,
                                                              const std::string& deviation_id) {
  return AllRows(transaction, kSelectCloudBlocks, Params().Uuid(deviation_id),
                 [](const Rows& rows, int row) -> DeviationCloudBlockRow {
                   return {static_cast<int>(rows.Int(row, 0)), rows.Int(row, 1), rows.Real(row, 2), rows.Real(row, 3),
                           rows.Digest(row, 4)};
                 });
}

using DeviationResults = PostgresResults<DeviationMapRow, DeviationFilter, DeviationStore>;

class PostgresDeviations final : public DeviationResults {
 public:
  using DeviationResults::DeviationResults;

  absl::StatusOr<std::optional<DeviationPatchesRow>> Patches(const std::string& deviation_id,
                                                             Deadline deadline) const override {
    return OneRead(database(), deadline, [&](Transaction& t) { return FindDeviationPatches(t, deviation_id); });
  }
  absl::StatusOr<std::vector<DeviationCloudBlockRow>> Cloud(const std::string& deviation_id,
                                                            Deadline deadline) const override {
    return OneRead(database(), deadline, [&](Transaction& t) { return FindCloud(t, deviation_id); });
  }
  absl::StatusOr<std::string> CloudBytes(const std::string& blob_sha256, Deadline deadline) const override {
    return OneRead(database(), deadline, [&](Transaction& t) { return GetBlob(t, blob_sha256); });
  }
};

}  // namespace

absl::StatusOr<Recorded> InsertDeviationMap(Transaction& transaction, const DeviationMapRow& map,
                                            const RecordEntry& entry) {
  absl::Status status = transaction.Execute(kInsertMap, MapParams(map)).status();
  if (status.ok())
    status = transaction.Execute(kInsertDeviationScans, Params().Uuid(map.deviation_id).Texts(map.scan_ids)).status();
  if (status.ok()) status = InsertDeviationChildren(transaction, map);
  if (status.ok()) status = InsertDeviationPatches(transaction, map.deviation_id, map.patches);
  if (status.ok()) status = InsertCloud(transaction, map);
  if (!status.ok()) return status;
  return AppendRecord(transaction, map.deviation_id, entry);
}

std::shared_ptr<DeviationStore> DeviationsIn(Database* database) {
  return std::make_shared<PostgresDeviations>(database,
                                              DeviationResults::Statements{InsertDeviationMap, FindMap, ListMaps});
}

}  // namespace sixpoint::storage
