#include "storage/repairs.h"

#include <utility>

#include "storage/children.h"
#include "storage/each_row.h"
#include "storage/one_read.h"
#include "storage/postgres_results.h"
#include "storage/scan_keys.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_REPAIR_COLUMNS                                                                             \
  "repair_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, "        \
  "sensor_calibration_id, rotation_calibration_id, method, first_mm, repair_line_mm, target_mm, "           \
  "line_width_mm, mill_diameter_mm, mill_length_mm, extrapolation, cornered_edges, "                        \
  "leading_in_part_mm, farthest_mm, scallop_um, lead_deg, tilt_deg, depth_of_cut_mm, "                      \
  "finish_allowance_mm, roughing_step_mm, guard_um, chord_um, greatest_turn_deg, greatest_uncertainty_um, " \
  "camber_determination, "                                                                                  \
  "thickness_determination, leading_determination, trailing_determination, below_line_count, "              \
  "above_line_count, left_out_count, greatest_stock_mm, step_over_mm, roughing_layer_count, "               \
  "lap_count, place_count, path_length_mm, greatest_lift_um, place_count_below_line, "                      \
  "deepest_below_line_um, deepest_in_target_um, deepest_beyond_uncertainty_um, greatest_rest_um, "          \
  "mean_rest_um, contours_sha256, path_sha256, requested_by, software_version, computed_on"
constexpr char kInsertRepair[] =
    "INSERT INTO repairs (" SIXPOINT_REPAIR_COLUMNS
    ") VALUES ("
    "$1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, "
    "$23, $24, $25, $26, $27, $28, $29, $30, $31, $32, $33, $34, $35, $36, $37, $38, $39, $40, $41, $42, "
    "$43, $44, $45, $46, $47, $48, $49, $50, $51, $52, $53, $54, $55)";
#define SIXPOINT_SELECT_REPAIRS                                                               \
  "SELECT " SIXPOINT_REPAIR_COLUMNS                                                           \
  ", record_sequence, recorded_at, name_of(requested_by), entry_order, entry_operation FROM " \
  "repairs JOIN recorded r ON r.record_id = repair_id WHERE "
constexpr char kSelectRepair[] = SIXPOINT_SELECT_REPAIRS "repair_id = $1";
constexpr char kListRepairs[] =
    SIXPOINT_SELECT_REPAIRS SIXPOINT_RESULT_FILTER("repairs", "repair") SIXPOINT_NEWEST_FIRST "LIMIT $10";
#undef SIXPOINT_SELECT_REPAIRS
#undef SIXPOINT_REPAIR_COLUMNS
constexpr char kInsertRepairScans[] =
    "INSERT INTO repair_scans (repair_id, position_index, scan_key) "
    "SELECT $1::uuid, (position - 1)::integer, " SIXPOINT_SCAN_KEY(
        "scan") " FROM unnest($2::text[]) WITH ORDINALITY AS scans (scan, position)";
constexpr char kSelectRepairScans[] = "SELECT repair_id, " SIXPOINT_SCAN_ID(
    "scan_key") " FROM repair_scans WHERE repair_id = ANY ($1::uuid[]) ORDER BY repair_id, position_index";
constexpr char kInsertRepairSection[] =
    "INSERT INTO repair_sections (repair_id, position_index, z_mm, kind, remark, mean_expanded_uncertainty_um, "
    "greatest_expanded_uncertainty_um, greatest_rest_um, deepest_cut_um) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9)";
constexpr char kSelectRepairSections[] =
    "SELECT repair_id, z_mm, kind, remark, mean_expanded_uncertainty_um, greatest_expanded_uncertainty_um, "
    "greatest_rest_um, deepest_cut_um FROM repair_sections WHERE repair_id = ANY ($1::uuid[]) ORDER BY repair_id, "
    "position_index";
constexpr char kInsertRepairContour[] =
    "INSERT INTO repair_contours (repair_id, position_index, points_in_part_mm, expanded_uncertainties_um, rest_um) "
    "VALUES ($1, $2, $3, $4, $5)";
constexpr char kSelectRepairContours[] =
    "SELECT points_in_part_mm, expanded_uncertainties_um, rest_um FROM repair_contours WHERE repair_id = $1 ORDER BY "
    "position_index";
constexpr char kInsertRepairLap[] =
    "INSERT INTO repair_laps (repair_id, position_index, z_mm, allowance_mm, centres_in_part_mm, axes_in_part) "
    "VALUES ($1, $2, $3, $4, $5, $6)";
constexpr char kSelectRepairLaps[] =
    "SELECT z_mm, allowance_mm, centres_in_part_mm, axes_in_part FROM repair_laps WHERE repair_id = $1 ORDER BY "
    "position_index";

Params RepairParams(const RepairRow& row) {
  Params params;
  params.Uuid(row.repair_id).Text(row.blade_serial).Uuid(row.registration_id).Text(row.machine_id);
  params.Int(row.machine_revision).Text(row.part_id).Int(row.part_revision).Uuid(row.sensor_calibration_id);
  params.Uuid(row.rotation_calibration_id).Text(row.method);
  const RepairMethodRow& applied = row.applied;
  params.Real(applied.first_mm).Real(applied.repair_line_mm).Real(applied.target_mm).Real(applied.line_width_mm);
  params.Real(applied.mill_diameter_mm).Real(applied.mill_length_mm).Text(applied.extrapolation);
  params.Bool(applied.cornered_edges);
  applied.leading_in_part_mm.empty() ? params.Null() : params.Reals(applied.leading_in_part_mm);
  params.Real(applied.farthest_mm).Real(applied.scallop_um).Real(applied.lead_deg).Real(applied.tilt_deg);
  params.Real(applied.depth_of_cut_mm).Real(applied.finish_allowance_mm).Real(applied.roughing_step_mm);
  params.Real(applied.guard_um)
      .Real(applied.chord_um)
      .Real(applied.greatest_turn_deg)
      .Real(applied.greatest_uncertainty_um);
  if (row.determination)
    params.Real(row.determination->camber)
        .Real(row.determination->thickness)
        .Real(row.determination->leading)
        .Real(row.determination->trailing);
  else
    params.Null().Null().Null().Null();
  params.Int(row.below_line_count).Int(row.above_line_count).Int(row.left_out_count);
  params.Real(row.greatest_stock_mm).Real(row.step_over_mm).Int(row.roughing_layer_count).Int(row.lap_count);
  params.Int(row.place_count).Real(row.path_length_mm).Real(row.greatest_lift_um);
  const RepairRemovalRow& removal = row.removal;
  params.Int(removal.place_count_below_line).Real(removal.deepest_below_line_um).Real(removal.deepest_in_target_um);
  params.Real(removal.deepest_beyond_uncertainty_um).Real(removal.greatest_rest_um).Real(removal.mean_rest_um);
  params.Digest(row.contours_sha256).Digest(row.path_sha256);
  return params.Text(row.requested_by).Text(row.software_version).Text(row.computed_on);
}

RepairMethodRow ReadRepairMethod(const Rows& rows, int row) {
  RepairMethodRow applied;
  applied.first_mm = rows.Real(row, 10);
  applied.repair_line_mm = rows.Real(row, 11);
  applied.target_mm = rows.Real(row, 12);
  applied.line_width_mm = rows.Real(row, 13);
  applied.mill_diameter_mm = rows.Real(row, 14);
  applied.mill_length_mm = rows.Real(row, 15);
  applied.extrapolation = rows.Text(row, 16);
  applied.cornered_edges = rows.Bool(row, 17);
  if (!rows.IsNull(row, 18)) applied.leading_in_part_mm = rows.Reals(row, 18);
  applied.farthest_mm = rows.Real(row, 19);
  applied.scallop_um = rows.Real(row, 20);
  applied.lead_deg = rows.Real(row, 21);
  applied.tilt_deg = rows.Real(row, 22);
  applied.depth_of_cut_mm = rows.Real(row, 23);
  applied.finish_allowance_mm = rows.Real(row, 24);
  applied.roughing_step_mm = rows.Real(row, 25);
  applied.guard_um = rows.Real(row, 26);
  applied.chord_um = rows.Real(row, 27);
  applied.greatest_turn_deg = rows.Real(row, 28);
  applied.greatest_uncertainty_um = rows.Real(row, 29);
  return applied;
}

RepairRow ReadRepair(const Rows& rows, int row) {
  RepairRow found;
  found.repair_id = rows.Text(row, 0);
  found.blade_serial = rows.Text(row, 1);
  found.registration_id = rows.Text(row, 2);
  found.machine_id = rows.Text(row, 3);
  found.machine_revision = static_cast<int>(rows.Int(row, 4));
  found.part_id = rows.Text(row, 5);
  found.part_revision = static_cast<int>(rows.Int(row, 6));
  found.sensor_calibration_id = rows.Text(row, 7);
  found.rotation_calibration_id = rows.Text(row, 8);
  found.method = rows.Text(row, 9);
  found.applied = ReadRepairMethod(rows, row);
  if (!rows.IsNull(row, 30))
    found.determination =
        RepairDeterminationRow{rows.Real(row, 30), rows.Real(row, 31), rows.Real(row, 32), rows.Real(row, 33)};
  found.below_line_count = rows.Int(row, 34);
  found.above_line_count = rows.Int(row, 35);
  found.left_out_count = rows.Int(row, 36);
  found.greatest_stock_mm = rows.Real(row, 37);
  found.step_over_mm = rows.Real(row, 38);
  found.roughing_layer_count = static_cast<int>(rows.Int(row, 39));
  found.lap_count = static_cast<int>(rows.Int(row, 40));
  found.place_count = static_cast<int>(rows.Int(row, 41));
  found.path_length_mm = rows.Real(row, 42);
  found.greatest_lift_um = rows.Real(row, 43);
  found.removal = {static_cast<int>(rows.Int(row, 44)),
                   rows.Real(row, 45),
                   rows.Real(row, 46),
                   rows.Real(row, 47),
                   rows.Real(row, 48),
                   rows.Real(row, 49)};
  found.contours_sha256 = rows.Digest(row, 50);
  found.path_sha256 = rows.Digest(row, 51);
  found.software_version = rows.Text(row, 53);
  found.computed_on = rows.Text(row, 54);
  found.recorded = {rows.Int(row, 55), rows.Time(row, 56)};
  found.requested_by = rows.Text(row, 57);
  found.work_order = rows.OptionalText(row, 58);
  found.operation = rows.OptionalText(row, 59);
  return found;
}

absl::StatusOr<std::vector<RepairRow>> ReadRepairs(Transaction& transaction, const char* sql, const Params& params) {
  auto all = AllRows(transaction, sql, params, ReadRepair);
  if (!all.ok() || all->empty()) return all;
  const ParentRows<RepairRow> parents(&*all, &RepairRow::repair_id);
  const Params ids = Params().Uuids(parents.ids());
  absl::Status read =
      parents.Add(transaction.Execute(kSelectRepairScans, ids),
                  [](RepairRow& parent, const Rows& scan, int row) { parent.scan_ids.push_back(scan.Text(row, 1)); });
  if (read.ok())
    read = parents.Add(transaction.Execute(kSelectRepairSections, ids),
                       [](RepairRow& parent, const Rows& section, int row) {
                         parent.sections.push_back({section.Real(row, 1), section.Text(row, 2), section.Text(row, 3),
                                                    section.OptionalReal(row, 4), section.OptionalReal(row, 5),
                                                    section.OptionalReal(row, 6), section.OptionalReal(row, 7)});
                       });
  if (!read.ok()) return read;
  return all;
}

absl::StatusOr<std::optional<RepairRow>> FindRepair(Transaction& transaction, const std::string& id) {
  return FirstOf(ReadRepairs(transaction, kSelectRepair, Params().Uuid(id)));
}

absl::StatusOr<std::vector<RepairRow>> ListRepairs(Transaction& transaction, const RepairFilter& filter,
                                                   std::int64_t before_sequence, int limit) {
  absl::StatusOr<Params> params = FilterParams(transaction, before_sequence, filter);
  if (!params.ok()) return params.status();
  return ReadRepairs(transaction, kListRepairs, params->Int(limit));
}

absl::Status InsertRepairSection(Transaction& transaction, const std::string& id, std::size_t position,
                                 const RepairSectionRow& section) {
  Params params;
  params.Uuid(id).Int(static_cast<std::int64_t>(position)).Real(section.z_mm).Text(section.kind).Text(section.remark);
  params.OptionalReal(section.mean_expanded_uncertainty_um).OptionalReal(section.greatest_expanded_uncertainty_um);
  params.OptionalReal(section.greatest_rest_um).OptionalReal(section.deepest_cut_um);
  return transaction.Execute(kInsertRepairSection, params).status();
}

absl::Status InsertRepairContour(Transaction& transaction, const std::string& id, std::size_t position,
                                 const RepairContourRow& contour) {
  Params params;
  params.Uuid(id).Int(static_cast<std::int64_t>(position)).Reals(contour.points_in_part_mm);
  params.Reals(contour.expanded_uncertainties_um).Reals(contour.rest_um);
  return transaction.Execute(kInsertRepairContour, params).status();
}

absl::Status InsertRepairLap(Transaction& transaction, const std::string& id, std::size_t position,
                             const RepairLapRow& lap) {
  Params params;
  params.Uuid(id).Int(static_cast<std::int64_t>(position)).Real(lap.z_mm).Real(lap.allowance_mm);
  return transaction.Execute(kInsertRepairLap, params.Reals(lap.centres_in_part_mm).Reals(lap.axes_in_part)).status();
}

using RepairResults = PostgresResults<RepairRow, RepairFilter, RepairStore>;

class PostgresRepairs final : public RepairResults {
 public:
  using RepairResults::RepairResults;

  absl::StatusOr<std::vector<RepairContourRow>> Contours(const std::string& repair_id,
                                                         Deadline deadline) const override {
    return All<RepairContourRow>(repair_id, deadline, kSelectRepairContours, [](const Rows& rows, int row) {
      return RepairContourRow{rows.Reals(row, 0), rows.Reals(row, 1), rows.Reals(row, 2)};
    });
  }
  absl::StatusOr<std::vector<RepairLapRow>> Laps(const std::string& repair_id, Deadline deadline) const override {
    return All<RepairLapRow>(repair_id, deadline, kSelectRepairLaps, [](const Rows& rows, int row) {
      return RepairLapRow{rows.Real(row, 0), rows.Real(row, 1), rows.Reals(row, 2), rows.Reals(row, 3)};
    });
  }

 private:
  template <typename Row, typename Read>
  absl::StatusOr<std::vector<Row>> All(const std::string& repair_id, Deadline deadline, const char* select,
                                       const Read& read) const {
    return OneRead(database(), deadline, [&](Transaction& transaction) -> absl::StatusOr<std::vector<Row>> {
      return AllRows(transaction, select, Params().Uuid(repair_id), read);
    });
  }
};

}  // namespace

absl::StatusOr<Recorded> InsertRepair(Transaction& transaction, const RepairRow& repair, const RecordEntry& entry) {
  absl::Status status = transaction.Execute(kInsertRepair, RepairParams(repair)).status();
  if (status.ok())
    status = transaction.Execute(kInsertRepairScans, Params().Uuid(repair.repair_id).Texts(repair.scan_ids)).status();
  for (std::size_t i = 0; status.ok() && i < repair.sections.size(); ++i)
    status = InsertRepairSection(transaction, repair.repair_id, i, repair.sections[i]);
  for (std::size_t i = 0; status.ok() && i < repair.contours.size(); ++i)
    status = InsertRepairContour(transaction, repair.repair_id, i, repair.contours[i]);
  for (std::size_t i = 0; status.ok() && i < repair.laps.size(); ++i)
    status = InsertRepairLap(transaction, repair.repair_id, i, repair.laps[i]);
  if (!status.ok()) return status;
  return AppendRecord(transaction, repair.repair_id, entry);
}

std::shared_ptr<RepairStore> RepairsIn(Database* database) {
  return std::make_shared<PostgresRepairs>(database, RepairResults::Statements{InsertRepair, FindRepair, ListRepairs});
}

}  // namespace sixpoint::storage
