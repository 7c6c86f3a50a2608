#include "storage/inspections.h"

#include <array>
#include <utility>

#include "storage/children.h"
#include "storage/each_row.h"
#include "storage/optional_reals.h"
#include "storage/postgres_results.h"
#include "storage/scan_keys.h"
#include "storage/three.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_INSPECTION_COLUMNS                                                                      \
  "inspection_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, " \
  "sensor_calibration_id, rotation_calibration_id, verdict, decision_rule, deviation_minimum_um, "       \
  "deviation_maximum_um, deviation_rms_um, deviation_p05_um, deviation_p50_um, deviation_p95_um, "       \
  "deviation_point_count, deviation_excluded_count, requested_by, software_version, method, "            \
  "disagreement_um, disagreement_ratio, positioning_disagrees, positioning_covered, budget_sources, "    \
  "computed_on, rejudges"
constexpr char kInsertInspection[] = "INSERT INTO inspections (" SIXPOINT_INSPECTION_COLUMNS
                                     ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, "
                                     "$17, $18, $19, $20, $21, $22, $23, $24, $25, $26, $27, $28, $29)";
#define SIXPOINT_SELECT_INSPECTIONS                                                                            \
  "SELECT " SIXPOINT_INSPECTION_COLUMNS                                                                        \
  ", record_sequence, recorded_at, name_of(requested_by), entry_order, entry_operation FROM inspections JOIN " \
  "recorded r ON r.record_id = inspection_id WHERE "
constexpr char kSelectInspection[] = SIXPOINT_SELECT_INSPECTIONS "inspection_id = $1";
constexpr char kListInspections[] = SIXPOINT_SELECT_INSPECTIONS SIXPOINT_RESULT_FILTER(
    "inspections",
    "inspection") "AND ($10 = '' OR verdict = $10) AND ($11 = '' OR entry_order = $11) " SIXPOINT_NEWEST_FIRST
                  "LIMIT $12";
#undef SIXPOINT_SELECT_INSPECTIONS
#undef SIXPOINT_INSPECTION_COLUMNS
constexpr char kInsertInspectionScans[] =
    "INSERT INTO inspection_scans (inspection_id, position_index, scan_key) "
    "SELECT $1::uuid, (position - 1)::integer, " SIXPOINT_SCAN_KEY(
        "scan") " FROM unnest($2::text[]) WITH ORDINALITY AS scans (scan, position)";
constexpr char kSelectInspectionScans[] =
    "SELECT inspection_id, " SIXPOINT_SCAN_ID("scan_key") " FROM inspection_scans WHERE inspection_id = ANY ($1::uuid[]) "
    "ORDER BY inspection_id, position_index";
#define SIXPOINT_HOLE_COLUMNS                                                                                        \
  "group_name, hole_name, verdict, position_verdict, inclination_verdict, position_error_mm, "                       \
  "inclination_error_deg, position_expanded_uncertainty_um, inclination_expanded_uncertainty_deg, "                  \
  "start_in_part_mm, axis_in_part, pin_diameter_mm, position_tolerance_mm, inclination_tolerance_deg, point_count, " \
  "pin_residual_rms_um, reason, positioning_difference_um, pin_half_play_um"
constexpr char kInsertInspectionHoles[] =
    "INSERT INTO inspection_holes (inspection_id, position_index, " SIXPOINT_HOLE_COLUMNS
    ", budget_um) SELECT $1::uuid, (position - 1)::integer, group_name, hole_name, verdict, position_verdict, "
    "inclination_verdict, "
    "position_error, inclination_error, position_uncertainty, inclination_uncertainty, "
    "CASE WHEN start_x IS NOT NULL THEN ARRAY[start_x, start_y, start_z] END, "
    "CASE WHEN axis_x IS NOT NULL THEN ARRAY[axis_x, axis_y, axis_z] END, diameter, position_tolerance, "
    "inclination_tolerance, point_count::integer, residual_rms, reason, positioning_difference, pin_play, "
    "nullif(budget, '')::real[] "
    "FROM unnest($2::text[], $3::text[], $4::text[], $5::text[], $6::text[], $7::text[], $8::text[], "
    "$9::double precision[], $10::double precision[], $11::double precision[], $12::double precision[], "
    "$13::double precision[], $14::double precision[], $15::double precision[], $16::double precision[], "
    "$17::double precision[], $18::double precision[], $19::double precision[], $20::double precision[], "
    "$21::double precision[], $22::double precision[], $23::double precision[], $24::double precision[], $25::text[]) "
    "WITH "
    "ORDINALITY AS holes (group_name, "
    "hole_name, verdict, position_verdict, inclination_verdict, reason, point_count, position_error, "
    "inclination_error, "
    "position_uncertainty, inclination_uncertainty, start_x, start_y, start_z, axis_x, axis_y, axis_z, diameter, "
    "position_tolerance, inclination_tolerance, residual_rms, positioning_difference, pin_play, budget, position)";
constexpr char kSelectInspectionHoles[] = "SELECT inspection_id, " SIXPOINT_HOLE_COLUMNS
                                          ", budget_um FROM inspection_holes WHERE inspection_id = ANY ($1::uuid[]) "
                                          "ORDER BY inspection_id, position_index";
#undef SIXPOINT_HOLE_COLUMNS

InspectionRow ReadInspection(const Rows& rows, int row) {
  InspectionRow inspection;
  inspection.inspection_id = rows.Text(row, 0);
  inspection.blade_serial = rows.Text(row, 1);
  inspection.registration_id = rows.Text(row, 2);
  inspection.machine_id = rows.Text(row, 3);
  inspection.machine_revision = static_cast<int>(rows.Int(row, 4));
  inspection.part_id = rows.Text(row, 5);
  inspection.part_revision = static_cast<int>(rows.Int(row, 6));
  inspection.sensor_calibration_id = rows.Text(row, 7);
  inspection.rotation_calibration_id = rows.Text(row, 8);
  inspection.verdict = rows.Text(row, 9);
  inspection.decision_rule = rows.Text(row, 10);
  inspection.deviation_minimum_um = rows.Real(row, 11);
  inspection.deviation_maximum_um = rows.Real(row, 12);
  inspection.deviation_rms_um = rows.Real(row, 13);
  inspection.deviation_p05_um = rows.Real(row, 14);
  inspection.deviation_p50_um = rows.Real(row, 15);
  inspection.deviation_p95_um = rows.Real(row, 16);
  inspection.deviation_point_count = rows.Int(row, 17);
  inspection.deviation_excluded_count = rows.Int(row, 18);
  inspection.requested_by = rows.Text(row, 31);
  inspection.software_version = rows.Text(row, 20);
  inspection.method = rows.Text(row, 21);
  if (!rows.IsNull(row, 22)) inspection.disagreement_um = rows.Real(row, 22);
  if (!rows.IsNull(row, 23)) inspection.disagreement_ratio = rows.Real(row, 23);
  inspection.positioning_disagrees = rows.Bool(row, 24);
  inspection.positioning_covered = rows.Bool(row, 25);
  if (!rows.IsNull(row, 26)) inspection.budget_sources = rows.Texts(row, 26);
  inspection.computed_on = rows.OptionalText(row, 27);
  inspection.rejudges_id = rows.OptionalText(row, 28);
  inspection.recorded = {rows.Int(row, 29), rows.Time(row, 30)};
  inspection.work_order = rows.OptionalText(row, 32);
  inspection.operation = rows.OptionalText(row, 33);
  return inspection;
}

Params InspectionParams(const InspectionRow& inspection) {
  Params params;
  params.Uuid(inspection.inspection_id).Text(inspection.blade_serial).Uuid(inspection.registration_id);
  params.Text(inspection.machine_id).Int(inspection.machine_revision).Text(inspection.part_id);
  params.Int(inspection.part_revision).Uuid(inspection.sensor_calibration_id).Uuid(inspection.rotation_calibration_id);
  params.Text(inspection.verdict).Text(inspection.decision_rule).Real(inspection.deviation_minimum_um);
  params.Real(inspection.deviation_maximum_um).Real(inspection.deviation_rms_um).Real(inspection.deviation_p05_um);
  params.Real(inspection.deviation_p50_um).Real(inspection.deviation_p95_um).Int(inspection.deviation_point_count);
  params.Int(inspection.deviation_excluded_count).Text(inspection.requested_by).Text(inspection.software_version);
  params.Text(inspection.method);
  for (const std::optional<double>& value : {inspection.disagreement_um, inspection.disagreement_ratio})
    value ? params.Real(*value) : params.Null();
  params.Bool(inspection.positioning_disagrees).Bool(inspection.positioning_covered);
  inspection.budget_sources.empty() ? params.Null() : params.Texts(inspection.budget_sources);
  params.OptionalText(inspection.computed_on).OptionalUuid(inspection.rejudges_id);
  return params;
}

InspectionHoleRow ReadInspectionHole(const Rows& rows, int row) {
  InspectionHoleRow hole;
  hole.group_name = rows.Text(row, 1);
  hole.hole_name = rows.Text(row, 2);
  hole.verdict = rows.Text(row, 3);
  hole.position_verdict = rows.Text(row, 4);
  hole.inclination_verdict = rows.Text(row, 5);
  if (!rows.IsNull(row, 6)) {
    hole.measured = InspectionHoleRow::Measured{rows.Real(row, 6),
                                                rows.Real(row, 7),
                                                rows.Real(row, 8),
                                                rows.Real(row, 9),
                                                ThreeOf(rows.Reals(row, 10)),
                                                ThreeOf(rows.Reals(row, 11)),
                                                rows.Real(row, 12)};
  }
  hole.position_tolerance_mm = rows.Real(row, 13);
  hole.inclination_tolerance_deg = rows.Real(row, 14);
  hole.point_count = static_cast<int>(rows.Int(row, 15));
  hole.pin_residual_rms_um = rows.Real(row, 16);
  hole.reason = rows.Text(row, 17);
  hole.positioning_difference_um = rows.Real(row, 18);
  if (!rows.IsNull(row, 19)) hole.pin_half_play_um = rows.Real(row, 19);
  hole.budget_um = OptionalRealsAt(rows, row, 20);
  return hole;
}

// As kInsertInspectionHoles has them: texts, then numbers, of what was not measured NULL.
Params HolesParams(const std::string& inspection_id, const std::vector<InspectionHoleRow>& holes) {
  std::array<std::vector<std::string>, 7> texts;
  std::array<std::vector<std::optional<double>>, 16> numbers;
  std::vector<std::string> budgets;
  for (const InspectionHoleRow& hole : holes) {
    std::size_t column = 0;
    for (const std::string& text : {hole.group_name, hole.hole_name, hole.verdict, hole.position_verdict,
                                    hole.inclination_verdict, hole.reason, std::to_string(hole.point_count)})
      texts[column++].push_back(text);
    column = 0;
    const auto add = [&](std::optional<double> value) { numbers[column++].push_back(value); };
    const auto add_measured = [&](const auto& value_of) {
      add(hole.measured ? std::optional<double>(value_of(*hole.measured)) : std::nullopt);
    };
    using Measured = InspectionHoleRow::Measured;
    add_measured([](const Measured& m) { return m.position_error_mm; });
    add_measured([](const Measured& m) { return m.inclination_error_deg; });
    add_measured([](const Measured& m) { return m.position_expanded_uncertainty_um; });
    add_measured([](const Measured& m) { return m.inclination_expanded_uncertainty_deg; });
    for (std::size_t i = 0; i < 3; ++i) add_measured([i](const Measured& m) { return m.start_in_part_mm[i]; });
    for (std::size_t i = 0; i < 3; ++i) add_measured([i](const Measured& m) { return m.axis_in_part[i]; });
    add_measured([](const Measured& m) { return m.pin_diameter_mm; });
    for (const double value : {hole.position_tolerance_mm, hole.inclination_tolerance_deg, hole.pin_residual_rms_um,
                               hole.positioning_difference_um})
      add(value);
    add(hole.pin_half_play_um);
    budgets.push_back(ArrayText(hole.budget_um));
  }
  Params params;
  params.Uuid(inspection_id);
  for (const std::vector<std::string>& column : texts) params.Texts(column);
  for (const std::vector<std::optional<double>>& column : numbers) params.OptionalReals(column);
  return params.Texts(budgets);
}

// Scans, holes and what is theirs of all the rows at once: a statement of each for a page.
absl::Status ReadChildren(Transaction& transaction, std::vector<InspectionRow>* inspections) {
  const ParentRows<InspectionRow> parents(inspections, &InspectionRow::inspection_id);
  if (parents.ids().empty()) return absl::OkStatus();
  const Params ids = Params().Uuids(parents.ids());
  const absl::Status scans = parents.Add(
      transaction.Execute(kSelectInspectionScans, ids),
      [](InspectionRow& inspection, const Rows& rows, int row) { inspection.scan_ids.push_back(rows.Text(row, 1)); });
  if (!scans.ok()) return scans;
  const auto dispositions = DispositionsOf(transaction, parents.ids());
  if (!dispositions.ok()) return dispositions.status();
  for (InspectionRow& inspection : *inspections)
    for (const DispositionRow& disposition : *dispositions)
      if (disposition.inspection_id == inspection.inspection_id) inspection.dispositions.push_back(disposition);
  const absl::Status holes = parents.Add(transaction.Execute(kSelectInspectionHoles, ids),
                                         [](InspectionRow& inspection, const Rows& rows, int row) {
                                           inspection.holes.push_back(ReadInspectionHole(rows, row));
                                         });
  return holes.ok() ? ReadHoleValues(transaction, parents) : holes;
}

absl::StatusOr<std::vector<InspectionRow>> ReadInspections(Transaction& transaction, const char* sql,
                                                           const Params& params) {
  auto inspections = AllRows(transaction, sql, params, ReadInspection);
  if (!inspections.ok()) return inspections;
  if (absl::Status status = ReadChildren(transaction, &*inspections); !status.ok()) return status;
  return inspections;
}

}  // namespace

std::shared_ptr<InspectionStore> InspectionsIn(Database* database) {
  using Store = PostgresResults<InspectionRow, InspectionFilter>;
  return std::make_shared<Store>(database, Store::Statements{InsertInspection, FindInspection, ListInspections});
}

absl::StatusOr<Recorded> InsertInspection(Transaction& transaction, const InspectionRow& inspection,
                                          const RecordEntry& entry) {
  const auto inserted = transaction.Execute(kInsertInspection, InspectionParams(inspection));
  if (!inserted.ok()) return inserted.status();
  const auto scans =
      transaction.Execute(kInsertInspectionScans, Params().Uuid(inspection.inspection_id).Texts(inspection.scan_ids));
  if (!scans.ok()) return scans.status();
  const auto holes =
      transaction.Execute(kInsertInspectionHoles, HolesParams(inspection.inspection_id, inspection.holes));
  if (!holes.ok()) return holes.status();
  if (absl::Status values = InsertHoleValues(transaction, inspection); !values.ok()) return values;
  return AppendRecord(transaction, inspection.inspection_id, entry);
}

absl::StatusOr<std::optional<InspectionRow>> FindInspection(Transaction& transaction,
                                                            const std::string& inspection_id) {
  return FirstOf(ReadInspections(transaction, kSelectInspection, Params().Uuid(inspection_id)));
}

absl::StatusOr<std::vector<InspectionRow>> ListInspections(Transaction& transaction, const InspectionFilter& filter,
                                                           std::int64_t before_sequence, int limit) {
  absl::StatusOr<Params> params = FilterParams(transaction, before_sequence, filter);
  if (!params.ok()) return params.status();
  return ReadInspections(transaction, kListInspections,
                         params->Text(filter.verdict).Text(filter.work_order).Int(limit));
}

}  // namespace sixpoint::storage
