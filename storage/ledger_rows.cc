#include "storage/ledger_rows.h"

#include <algorithm>
#include <ctime>
#include <iterator>
#include <limits>
#include <sstream>

#include "storage/each_row.h"

namespace sixpoint::storage {
namespace {

// Built-in functions and operators alone, whatever the path of the role or the database; by a statement that no function stands in for.
constexpr char kPath[] = "SET LOCAL search_path = pg_catalog, pg_temp";
// JIT compiles for longer than it runs.
constexpr char kBegin[] =
    "SELECT pg_catalog.set_config('role', 'sixpoint_ledger', true), pg_catalog.set_config('timezone', 'UTC', true), "
    "pg_catalog.set_config('datestyle', 'ISO, YMD', true), pg_catalog.set_config('intervalstyle', 'postgres', true), "
    "pg_catalog.set_config('bytea_output', 'hex', true), pg_catalog.set_config('extra_float_digits', '1', true), "
    "pg_catalog.set_config('quote_all_identifiers', 'off', true), pg_catalog.set_config('jit', 'off', true), "
    "pg_catalog.set_config('row_security', 'off', true)";
constexpr char kColumns[] =
    "SELECT c.relname, a.attname FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid "
    "WHERE c.relnamespace = 'public'::regnamespace AND c.relname = ANY ($1) AND a.attnum > 0 AND NOT a.attisdropped "
    "ORDER BY c.relname, a.attname COLLATE \"C\"";
// By the bound, which holds for the rows: a name may be anything.
constexpr char kPartitionMonths[] =
    "SELECT substring(pg_get_expr(c.relpartbound, c.oid) FROM "
    "'[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}') FROM pg_inherits i JOIN pg_class c ON c.oid = "
    "i.inhrelid WHERE i.inhparent = 'public.record_entries'::regclass";

constexpr char kByPart[] = "JOIN public.part_revisions r ON r.part_id = t.part_id AND r.revision = t.revision";
constexpr char kByMachine[] =
    "JOIN public.machine_revisions r ON r.machine_id = t.machine_id AND r.revision = t.revision";
constexpr char kByArtefact[] =
    "JOIN public.artefact_revisions r ON r.artefact_id = t.artefact_id AND r.revision = t.revision";
constexpr char kByModel[] =
    "JOIN public.machining_model_revisions r ON r.machining_model_id = t.machining_model_id AND r.revision = "
    "t.revision";
constexpr char kByDrawing[] =
    "JOIN public.drawing_revisions r ON r.drawing_id = t.drawing_id AND r.revision = t.revision";
constexpr char kBySurface[] =
    "JOIN public.part_revisions r ON r.cad_sha256 = t.cad_sha256 AND r.tessellation_method = t.method";

std::string Quoted(const std::string& identifier) {
  std::string quoted = "\"";
  for (const char c : identifier) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string Literal(const std::string& text) {
  std::string literal = "'";
  for (const char c : text) literal += c == '\'' ? std::string("''") : std::string(1, c);
  return literal + "'";
}

// Rows of $1's entries as id, text. The bounds tell the planner which months to look into; joined and not = ANY, whose elements it would
// count one by one for each table.
std::string RowsSql(const LedgerTable& table, const std::vector<std::string>& columns) {
  return std::string("SELECT ") + table.owner + " AS id, " + RowTextSql(columns) + " AS line FROM public." +
         Quoted(table.name) + " t " + table.join +
         " JOIN unnest($1::uuid[]) AS batch (id) ON batch.id = " + table.owner + " WHERE " + table.owner +
         " BETWEEN $2 AND $3";
}

absl::StatusOr<std::vector<std::string>> ColumnsOf(const LedgerColumns& columns, const char* table) {
  const auto found = columns.find(table);
  if (found == columns.end())
    return absl::DataLossError(std::string("public.") + table + ": not there, want the table");
  return found->second;
}

constexpr LedgerTable kTables[] = {
    {"artefact_features", "r.record_id", kByArtefact, false},
    {"artefact_revisions", "t.record_id", "", false},
    {"assessment_conflicts", "t.assessment_id", "", false},
    {"assessment_findings", "t.assessment_id", "", false},
    {"assessment_others", "t.assessment_id", "", false},
    {"assessment_results", "t.assessment_id", "", false},
    {"assessments", "t.assessment_id", "", false},
    {"axis_characterisations", "t.calibration_id", "", false},
    {"blade_work_orders", "t.record_id", "", false},
    {"blades", "t.record_id", "", false},
    {"blank_patches", "t.reconstruction_id", "", false},
    {"calibration_events", "t.record_id", "", false},
    {"calibrations", "t.calibration_id", "", false},
    {"correction_checks", "t.correction_id", "", false},
    {"correction_cuts", "t.record_id", "", true},
    {"correction_events", "t.record_id", "", true},
    {"correction_groups", "t.correction_id", "", false},
    {"correction_holes", "t.correction_id", "", false},
    {"correction_tool_paths", "t.correction_id", "", false},
    {"corrections", "t.correction_id", "", false},
    {"deviation_cloud_blocks", "t.deviation_id", "", false},
    {"deviation_map_scans", "t.deviation_id", "", false},
    {"deviation_maps", "t.deviation_id", "", false},
    {"deviation_patches", "t.deviation_id", "", false},
    {"deviation_profile_areas", "t.deviation_id", "", false},
    {"deviation_profiles", "t.deviation_id", "", false},
    {"deviation_regions", "t.deviation_id", "", false},
    {"dispositions", "t.disposition_id", "", false},
    {"drawing_characteristics", "r.record_id", kByDrawing, false},
    {"drawing_datum_systems", "r.record_id", kByDrawing, false},
    {"drawing_datums", "r.record_id", kByDrawing, false},
    {"drawing_part_revisions", "r.record_id", kByDrawing, false},
    {"drawing_product_requirements", "r.record_id", kByDrawing, false},
    {"drawing_regions", "r.record_id", kByDrawing, false},
    {"drawing_revisions", "t.record_id", "", false},
    {"drawing_sections", "r.record_id", kByDrawing, false},
    {"inspection_hole_values", "t.inspection_id", "", false},
    {"inspection_holes", "t.inspection_id", "", false},
    {"inspection_pitches", "t.inspection_id", "", false},
    {"inspection_scans", "t.inspection_id", "", false},
    {"inspections", "t.inspection_id", "", false},
    {"interim_checks", "t.study_id", "", false},
    {"machine_joints", "r.record_id", kByMachine, false},
    {"machine_revisions", "t.record_id", "", false},
    {"machining_model_revisions", "t.record_id", "", false},
    {"machining_operations", "r.record_id", kByModel, false},
    {"machining_post_processors", "r.record_id", kByModel, false},
    {"machining_pass_patches", "t.pass_id", "", false},
    {"machining_pass_regions", "t.pass_id", "", false},
    {"machining_pass_scans", "t.pass_id", "", false},
    {"machining_passes", "t.pass_id", "", false},
    {"machining_tool_paths", "r.record_id", kByModel, false},
    {"measurement_values", "t.measurement_id", "", false},
    {"measurements", "t.measurement_id", "", false},
    {"part_datum_points", "r.record_id", kByPart, false},
    {"part_hole_groups", "r.record_id", kByPart, false},
    {"part_holes", "r.record_id", kByPart, false},
    {"part_revisions", "t.record_id", "", false},
    {"part_shape_regions", "r.record_id", kByPart, false},
    {"part_stations", "r.record_id", kByPart, false},
    {"probe_calibration_checks", "t.calibration_id", "", false},
    {"probe_calibration_readings", "t.calibration_id", "", false},
    {"probe_calibrations", "t.calibration_id", "", false},
    {"program_fetches", "t.fetch_id", "", false},
    {"reconstruction_holds", "t.reconstruction_id", "", false},
    {"reconstruction_regions", "t.reconstruction_id", "", false},
    {"reconstruction_scans", "t.reconstruction_id", "", false},
    {"reconstructions", "t.reconstruction_id", "", false},
    {"record_entries", "t.record_id", "", false},
    {"record_inputs", "t.record_id", "", false},
    {"record_roots", "t.record_id", "", false},
    {"registration_agreements", "t.registration_id", "", false},
    {"registration_angles", "t.registration_id", "", false},
    {"registration_datums", "t.registration_id", "", false},
    {"registration_error_sources", "t.registration_id", "", false},
    {"registration_scans", "t.registration_id", "", false},
    {"registrations", "t.registration_id", "", false},
    {"repair_contours", "t.repair_id", "", false},
    {"repair_laps", "t.repair_id", "", false},
    {"repair_scans", "t.repair_id", "", false},
    {"repair_sections", "t.repair_id", "", false},
    {"repairs", "t.repair_id", "", false},
    {"retention_policies", "t.record_id", "", false},
    {"rotation_calibration_poses", "t.calibration_id", "", false},
    {"rotation_calibrations", "t.calibration_id", "", false},
    {"scan_blocks", "t.scan_key", "", false},
    {"scan_deletions", "t.record_id", "", true},
    {"scans", "t.scan_key", "", false},
    {"section_measurement_scans", "t.section_measurement_id", "", false},
    {"section_measurements", "t.section_measurement_id", "", false},
    {"section_outlines", "t.section_measurement_id", "", false},
    {"section_values", "t.section_measurement_id", "", false},
    {"sections", "t.section_measurement_id", "", false},
    {"sensor_calibration_centres", "t.calibration_id", "", false},
    {"sensor_calibrations", "t.calibration_id", "", false},
    {"studies", "t.study_id", "", false},
    {"tessellations", "r.record_id", kBySurface, false},
};

Params IdsAndTheirBounds(const std::vector<std::string>& ids) {
  Params params;
  params.Uuids(ids).Uuid(*std::min_element(ids.begin(), ids.end())).Uuid(*std::max_element(ids.begin(), ids.end()));
  return params;
}

}  // namespace

const std::vector<LedgerTable>& LedgerTables() {
  static const auto* const tables = new std::vector<LedgerTable>(std::begin(kTables), std::end(kTables));
  return *tables;
}

absl::Status BeginLedger(Transaction& transaction) {
  const absl::Status path = transaction.Execute(kPath).status();
  return path.ok() ? transaction.Execute(kBegin).status() : path;
}

bool IsByMonths(const std::string& table) {
  static const auto* const tables = new std::set<std::string>{"assessment_conflicts",
                                                              "assessment_findings",
                                                              "assessment_others",
                                                              "assessment_results",
                                                              "blank_patches",
                                                              "correction_checks",
                                                              "correction_cuts",
                                                              "correction_events",
                                                              "correction_groups",
                                                              "correction_holes",
                                                              "correction_tool_paths",
                                                              "corrections",
                                                              "deviation_cloud_blocks",
                                                              "deviation_map_scans",
                                                              "deviation_maps",
                                                              "deviation_patches",
                                                              "deviation_profile_areas",
                                                              "deviation_profiles",
                                                              "deviation_regions",
                                                              "inspection_hole_values",
                                                              "inspection_holes",
                                                              "inspection_pitches",
                                                              "inspection_scans",
                                                              "inspections",
                                                              "machining_pass_patches",
                                                              "machining_pass_regions",
                                                              "machining_pass_scans",
                                                              "machining_passes",
                                                              "measurement_values",
                                                              "measurements",
                                                              "program_fetches",
                                                              "reconstruction_holds",
                                                              "reconstruction_regions",
                                                              "reconstruction_scans",
                                                              "reconstructions",
                                                              "record_entries",
                                                              "record_inputs",
                                                              "record_roots",
                                                              "registration_agreements",
                                                              "registration_angles",
                                                              "registration_datums",
                                                              "registration_error_sources",
                                                              "registration_scans",
                                                              "registrations",
                                                              "repair_contours",
                                                              "repair_laps",
                                                              "repair_scans",
                                                              "repair_sections",
                                                              "repairs",
                                                              "scan_blocks",
                                                              "scan_deletions",
                                                              "scans",
                                                              "section_measurement_scans",
                                                              "section_measurements",
                                                              "section_outlines",
                                                              "section_values",
                                                              "sections"};
  return tables->count(table) > 0;
}

absl::StatusOr<LedgerColumns> ReadLedgerColumns(Transaction& transaction) {
  std::vector<std::string> names = {"record_names"};
  for (const LedgerTable& table : LedgerTables()) names.emplace_back(table.name);
  const absl::StatusOr<Rows> rows = transaction.Execute(kColumns, Params().Texts(names));
  if (!rows.ok()) return rows.status();
  LedgerColumns columns;
  for (int row = 0; row < rows->count(); ++row) columns[rows->Text(row, 0)].push_back(rows->Text(row, 1));
  return rows->Checked(std::move(columns));
}

std::string RowTextSql(const std::vector<std::string>& columns) {
  std::string sql = "'{' || concat_ws(',', VARIADIC ARRAY[";
  for (const std::string& column : columns)
    sql += (column == columns.front() ? "" : ", ") + Literal("\"" + column + "\":") + " || to_json(t." +
           Quoted(column) + "::text)::text";
  return sql + "]) || '}'";
}

absl::StatusOr<std::map<std::string, Content>> ReadContents(Transaction& transaction, const LedgerColumns& columns,
                                                            const std::vector<std::string>& record_ids) {
  std::map<std::string, Content> contents;
  if (record_ids.empty()) return contents;
  std::string sql;
  for (const LedgerTable& table : LedgerTables()) {
    const absl::StatusOr<std::vector<std::string>> of_table = ColumnsOf(columns, table.name);
    if (!of_table.ok()) return of_table.status();
    sql += (sql.empty() ? "" : " UNION ALL ") +
           ("SELECT q.id, '" + std::string(table.name) +
            "', count(*), sha256(string_agg(q.digest, ''::bytea ORDER BY q.digest)) FROM "
            "(SELECT rows.id, sha256(convert_to(rows.line, 'UTF8')) AS digest FROM (") +
           RowsSql(table, *of_table) + ") rows) q GROUP BY q.id";
  }
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, IdsAndTheirBounds(record_ids));
  if (!rows.ok()) return rows.status();
  for (int row = 0; row < rows->count(); ++row)
    contents[rows->Text(row, 0)][rows->Text(row, 1)] = {rows->Int(row, 2), rows->Digest(row, 3)};
  return rows->Checked(std::move(contents));
}

std::string ContentText(const Content& content) {
  std::string text;
  for (const auto& [table, rows] : content) text += table + " " + std::to_string(rows.count) + " " + rows.sha256 + "\n";
  return text;
}

Content ContentOf(const std::string& text) {
  Content content;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string table;
    RowsDigest rows;
    if (words >> table >> rows.count >> rows.sha256) content[table] = rows;
  }
  return content;
}

absl::StatusOr<std::map<std::string, std::vector<std::string>>> ReadRowTexts(Transaction& transaction,
                                                                             const LedgerColumns& columns,
                                                                             const std::string& record_id,
                                                                             std::int64_t most_bytes) {
  std::map<std::string, std::vector<std::string>> texts;
  std::string sql;
  for (const LedgerTable& table : LedgerTables()) {
    const absl::StatusOr<std::vector<std::string>> of_table = ColumnsOf(columns, table.name);
    if (!of_table.ok()) return of_table.status();
    sql += (sql.empty() ? "" : " UNION ALL ") + ("SELECT '" + std::string(table.name) + "', rows.line FROM (") +
           RowsSql(table, *of_table) + ") rows WHERE (SELECT sum(octet_length(sized.line)) FROM (" +
           RowsSql(table, *of_table) + ") sized) <= " + std::to_string(most_bytes);
  }
  sql = "SELECT of_table, line FROM (" + sql +
        ") all_rows (of_table, line) ORDER BY of_table, sha256(convert_to(line, 'UTF8'))";
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, IdsAndTheirBounds({record_id}));
  if (!rows.ok()) return rows.status();
  for (int row = 0; row < rows->count(); ++row) texts[rows->Text(row, 0)].push_back(rows->Text(row, 1));
  return rows->Checked(std::move(texts));
}

absl::StatusOr<std::vector<NamedRecord>> ReadNames(Transaction& transaction, const LedgerColumns& columns,
                                                   std::int64_t after, std::int64_t until, std::int64_t limit) {
  const absl::StatusOr<std::vector<std::string>> of_table = ColumnsOf(columns, "record_names");
  if (!of_table.ok()) return of_table.status();
  const std::string beyond = after == std::numeric_limits<std::int64_t>::min() ? ">=" : ">";
  const std::string sql = "SELECT t.record_id, t.name, t.record_sequence, sha256(convert_to(" + RowTextSql(*of_table) +
                          ", 'UTF8')) FROM public.record_names t WHERE t.record_sequence " + beyond +
                          " $1 AND t.record_sequence <= "
                          "$2 ORDER BY t.record_sequence LIMIT $3";
  return AllRows(transaction, sql, Params().Int(after).Int(until).Int(limit),
                 [](const Rows& rows, int row) -> NamedRecord {
                   return {rows.Text(row, 0), rows.Text(row, 1), rows.Int(row, 2), rows.Bytes(row, 3)};
                 });
}

absl::StatusOr<NameText> ReadNameText(Transaction& transaction, const LedgerColumns& columns,
                                      const std::string& record_id) {
  const absl::StatusOr<std::vector<std::string>> of_table = ColumnsOf(columns, "record_names");
  if (!of_table.ok()) return of_table.status();
  const std::string sql =
      "SELECT t.name, " + RowTextSql(*of_table) + " FROM public.record_names t WHERE t.record_id = $1";
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, Params().Uuid(record_id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return absl::NotFoundError("record_names: " + record_id + ", want its row");
  return rows->Checked(NameText{rows->Text(0, 0), rows->Text(0, 1)});
}

absl::StatusOr<std::set<std::string>> AttachedMonths(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kPartitionMonths);
  if (!rows.ok()) return rows.status();
  std::set<std::string> months;
  for (int row = 0; row < rows->count(); ++row)
    if (!rows->IsNull(row, 0)) months.insert(MonthOf(rows->Text(row, 0)));
  return rows->Checked(std::move(months));
}

std::string MonthOf(const std::string& record_id) {
  const std::string digits = record_id.substr(0, 8) + record_id.substr(std::min<std::size_t>(9, record_id.size()), 4);
  const std::time_t seconds = static_cast<std::time_t>(std::strtoull(digits.c_str(), nullptr, 16) / 1000);
  std::tm utc{};
  char text[32] = "";
  if (gmtime_r(&seconds, &utc) != nullptr) std::strftime(text, sizeof text, "%Y_%m", &utc);
  return text;
}

}  // namespace sixpoint::storage
