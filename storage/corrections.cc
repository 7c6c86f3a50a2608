#include "storage/corrections.h"

#include <algorithm>
#include <array>
#include <utility>

#include "storage/blobs.h"
#include "storage/children.h"
#include "storage/each_row.h"
#include "storage/postgres_results.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_CORRECTION_COLUMNS                                                                                   \
  "correction_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, "              \
  "sensor_calibration_id, rotation_calibration_id, nc_template_sha256, nc_program_sha256, release, release_reasons, " \
  "envelope_translation_mm, envelope_rotation_deg, valid_until, requested_by, software_version, axes, "               \
  "nc_reader_version, nc_pose_count, nc_greatest_difference_um, nc_greatest_tilt_deg, nc_work_offset_codes, "         \
  "nc_work_offsets, nc_held_sha256, nc_tool_numbers, nc_tool_lengths_mm, registration_age_h, clamping, "              \
  "budget_sources, computed_on, machining_model_id, machining_model_revision, reconstruction_id, machining_pass_id, " \
  "repair_id"
constexpr char kInsertCorrection[] =
    "INSERT INTO corrections (" SIXPOINT_CORRECTION_COLUMNS
    ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, "
    "$17, $18, $19, $20, $21, $22, $23, $24, $25, $26, $27::integer[], $28, $29, $30, $31, $32, $33, $34, $35, $36, "
    "$37)";
// With whose tables: the registration's are the correction's.
#define SIXPOINT_SELECT_CORRECTIONS                                                                               \
  "SELECT " SIXPOINT_CORRECTION_COLUMNS                                                                           \
  ", ARRAY(SELECT DISTINCT a.characterisation_id FROM registration_angles a WHERE a.registration_id = "           \
  "corrections.registration_id AND a.characterisation_id IS NOT NULL ORDER BY 1), record_sequence, recorded_at, " \
  "state, usable_until, superseded_by, "                                                                          \
  "name_of(requested_by) "                                                                                        \
  "FROM corrections JOIN recorded r ON r.record_id = correction_id JOIN correction_states USING (correction_id) " \
  "WHERE "
constexpr char kSelectCorrection[] = SIXPOINT_SELECT_CORRECTIONS "correction_id = $1";
constexpr char kListCorrections[] = SIXPOINT_SELECT_CORRECTIONS SIXPOINT_RESULT_FILTER(
    "corrections", "correction") "AND ($10 = '' OR release = $10) AND ($11 = '' OR state = $11) " SIXPOINT_NEWEST_FIRST
                                 "LIMIT $12";
#undef SIXPOINT_SELECT_CORRECTIONS
#undef SIXPOINT_CORRECTION_COLUMNS
constexpr char kInsertCorrectionGroup[] =
    "INSERT INTO correction_groups (correction_id, position_index, group_name, a_deg, b_deg, a_nominal_deg, "
    "b_nominal_deg, a_ideal_deg, b_ideal_deg, a_standard_uncertainty_deg, b_standard_uncertainty_deg, a_reached_deg, "
    "b_reached_deg, tilt_deg) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14)";
constexpr char kInsertCorrectionHoles[] =
    "INSERT INTO correction_holes (correction_id, group_name, position_index, hole_name, start_x_mm, start_y_mm, "
    "start_z_mm, nominal_start_x_mm, nominal_start_y_mm, nominal_start_z_mm, expanded_uncertainty_um, budget_um) "
    "SELECT $1::uuid, $2::text, (position - 1)::integer, hole, x, y, z, nominal_x, nominal_y, nominal_z, uncertainty, "
    "nullif(budget, '')::real[] "
    "FROM unnest($3::text[], $4::double precision[], $5::double precision[], $6::double precision[], "
    "$7::double precision[], $8::double precision[], $9::double precision[], $10::double precision[], $11::text[]) "
    "WITH ORDINALITY AS holes (hole, x, y, z, nominal_x, nominal_y, nominal_z, uncertainty, budget, position)";
constexpr char kInsertCheck[] =
    "INSERT INTO correction_checks (correction_id, position_index, kind, subject, value, limit_value, passed, "
    "failed_count) VALUES ($1, $2, $3, $4, $5, $6, $7, $8)";
constexpr char kSelectCorrectionChecks[] =
    "SELECT correction_id, kind, subject, value, limit_value, passed, failed_count FROM correction_checks "
    "WHERE correction_id = ANY ($1::uuid[]) ORDER BY correction_id, position_index";
constexpr char kSelectDecisions[] =
    "SELECT correction_id, event, reason, name_of(requested_by), recorded_at FROM correction_events "
    "JOIN record_names USING (record_id) WHERE correction_id = ANY ($1::uuid[])";
constexpr char kSelectCorrectionGroups[] =
    "SELECT correction_id, group_name, a_deg, b_deg, a_nominal_deg, b_nominal_deg, a_ideal_deg, b_ideal_deg, "
    "a_standard_uncertainty_deg, b_standard_uncertainty_deg, a_reached_deg, b_reached_deg, tilt_deg FROM "
    "correction_groups "
    "WHERE correction_id = ANY ($1::uuid[]) ORDER BY correction_id, position_index";
constexpr char kSelectCorrectionHoles[] =
    "SELECT h.correction_id, h.group_name, h.hole_name, start_x_mm, start_y_mm, start_z_mm, nominal_start_x_mm, "
    "nominal_start_y_mm, nominal_start_z_mm, expanded_uncertainty_um, n.recorded_at, budget_um FROM "
    "correction_holes h "
    "LEFT JOIN correction_cuts c USING (correction_id, group_name, hole_name) "
    "LEFT JOIN record_names n ON n.record_id = c.record_id "
    "WHERE h.correction_id = ANY ($1::uuid[]) ORDER BY h.correction_id, h.group_name, h.position_index";

void AddDigest(Params& params, const std::optional<std::string>& sha256) {
  sha256 ? params.Digest(*sha256) : params.Null();
}

CorrectionRow ReadCorrection(const Rows& rows, int row) {
  CorrectionRow correction;
  correction.correction_id = rows.Text(row, 0);
  correction.blade_serial = rows.Text(row, 1);
  correction.registration_id = rows.Text(row, 2);
  correction.machine_id = rows.Text(row, 3);
  correction.machine_revision = static_cast<int>(rows.Int(row, 4));
  correction.part_id = rows.Text(row, 5);
  correction.part_revision = static_cast<int>(rows.Int(row, 6));
  correction.sensor_calibration_id = rows.Text(row, 7);
  correction.rotation_calibration_id = rows.Text(row, 8);
  correction.release = rows.Text(row, 11);
  correction.release_reasons = rows.Texts(row, 12);
  correction.envelope_translation_mm = rows.Real(row, 13);
  correction.envelope_rotation_deg = rows.Real(row, 14);
  correction.valid_until = rows.Time(row, 15);
  correction.requested_by = rows.Text(row, 43);
  correction.software_version = rows.Text(row, 17);
  correction.axes = rows.Texts(row, 18);
  if (!rows.IsNull(row, 19))
    correction.proof = ProgramProofRow{rows.Text(row, 19), static_cast<int>(rows.Int(row, 20)), rows.Real(row, 21),
                                       rows.Real(row, 22)};
  correction.work_offsets = WorkOffsetsAt(rows, row, 23);
  if (!rows.IsNull(row, 9)) correction.template_sha256 = rows.Digest(row, 9);
  for (const int program : {10, 25})
    if (!rows.IsNull(row, program)) correction.program_sha256 = rows.Digest(row, program);
  correction.tool_lengths = ToolLengthsAt(rows, row, 26);
  if (!rows.IsNull(row, 28)) correction.registration_age_h = rows.Real(row, 28);
  if (!rows.IsNull(row, 29)) correction.clamping = rows.Text(row, 29);
  if (!rows.IsNull(row, 30)) correction.budget_sources = rows.Texts(row, 30);
  correction.computed_on = rows.OptionalText(row, 31);
  correction.machining_model_id = rows.OptionalText(row, 32);
  if (!rows.IsNull(row, 33)) correction.machining_model_revision = static_cast<int>(rows.Int(row, 33));
  correction.reconstruction_id = rows.OptionalText(row, 34);
  correction.machining_pass_id = rows.OptionalText(row, 35);
  correction.repair_id = rows.OptionalText(row, 36);
  correction.characterisation_ids = rows.Texts(row, 37);
  correction.recorded = {rows.Int(row, 38), rows.Time(row, 39)};
  correction.state = rows.Text(row, 40);
  correction.usable_until = rows.Time(row, 41);
  if (!rows.IsNull(row, 42)) correction.superseded_by = rows.Text(row, 42);
  return correction;
}

// As a blob; nothing of an empty one.
absl::StatusOr<std::optional<std::string>> KeepText(Transaction& transaction, const std::string& text) {
  if (text.empty()) return std::nullopt;
  absl::StatusOr<std::string> sha256 = PutBlob(transaction, text);
  if (!sha256.ok()) return sha256.status();
  return *std::move(sha256);
}

struct KeptTexts {
  std::optional<std::string> nc_template, nc_program, nc_held;  // their digests
};

Params CorrectionParams(const CorrectionRow& correction, const KeptTexts& kept) {
  Params params;
  params.Uuid(correction.correction_id).Text(correction.blade_serial).Uuid(correction.registration_id);
  params.Text(correction.machine_id).Int(correction.machine_revision).Text(correction.part_id);
  params.Int(correction.part_revision).Uuid(correction.sensor_calibration_id).Uuid(correction.rotation_calibration_id);
  AddDigest(params, kept.nc_template);
  AddDigest(params, kept.nc_program);
  params.Text(correction.release).Texts(correction.release_reasons).Real(correction.envelope_translation_mm);
  params.Real(correction.envelope_rotation_deg).Time(correction.valid_until).Text(correction.requested_by);
  params.Text(correction.software_version).Texts(correction.axes);
  if (const auto& proof = correction.proof; proof.has_value())
    params.Text(proof->reader_version)
        .Int(proof->pose_count)
        .Real(proof->greatest_difference_um)
        .Real(proof->greatest_tilt_deg);
  else
    params.Null().Null().Null().Null();
  Add(correction.work_offsets, &params);
  AddDigest(params, kept.nc_held);
  Add(correction.tool_lengths, &params);
  correction.registration_age_h.has_value() ? params.Real(*correction.registration_age_h) : params.Null();
  params.OptionalText(correction.clamping);
  correction.budget_sources.empty() ? params.Null() : params.Texts(correction.budget_sources);
  params.OptionalText(correction.computed_on).OptionalText(correction.machining_model_id);
  correction.machining_model_id.empty() ? params.Null() : params.Int(correction.machining_model_revision);
  return params.OptionalUuid(correction.reconstruction_id)
      .OptionalUuid(correction.machining_pass_id)
      .OptionalUuid(correction.repair_id);
}

absl::Status InsertChecks(Transaction& transaction, const CorrectionRow& correction) {
  int position = 0;
  for (const CorrectionCheckRow& check : correction.checks) {
    Params params;
    params.Uuid(correction.correction_id).Int(position++).Text(check.kind).Text(check.subject);
    check.value.has_value() ? params.Real(*check.value) : params.Null();
    params.Real(check.limit).Bool(check.passed).Int(check.failed_count);
    if (const auto stored = transaction.Execute(kInsertCheck, params); !stored.ok()) return stored.status();
  }
  return absl::OkStatus();
}

absl::Status InsertGroup(Transaction& transaction, const std::string& id, int position,
                         const CorrectionGroupRow& group) {
  Params params;
  params.Uuid(id).Int(position).Text(group.group_name).Real(group.a_deg).Real(group.b_deg).Real(group.a_nominal_deg);
  params.Real(group.b_nominal_deg).Real(group.a_ideal_deg).Real(group.b_ideal_deg);
  params.Real(group.a_standard_uncertainty_deg).Real(group.b_standard_uncertainty_deg);
  group.reached_deg ? params.Real((*group.reached_deg)[0]).Real((*group.reached_deg)[1]) : params.Null().Null();
  group.tilt_deg.has_value() ? params.Real(*group.tilt_deg) : params.Null();
  if (const auto stored = transaction.Execute(kInsertCorrectionGroup, params); !stored.ok()) return stored.status();
  std::vector<std::string> names, budgets;
  std::array<std::vector<double>, 6> coordinates;  // x, y, z of the starts, and of the nominal ones
  std::vector<double> uncertainties;
  for (const CorrectionHoleRow& hole : group.holes) {
    names.push_back(hole.hole_name);
    for (std::size_t i = 0; i < 3; ++i) {
      coordinates[i].push_back(hole.start_mm[i]);
      coordinates[3 + i].push_back(hole.nominal_start_mm[i]);
    }
    uncertainties.push_back(hole.expanded_uncertainty_um);
    budgets.push_back(ArrayText(hole.budget_um));
  }
  Params holes;
  holes.Uuid(id).Text(group.group_name).Texts(names);
  for (const std::vector<double>& values : coordinates) holes.Reals(values);
  const auto stored = transaction.Execute(kInsertCorrectionHoles, holes.Reals(uncertainties).Texts(budgets));
  if (!stored.ok() || !group.path) return stored.status();
  return InsertCorrectionToolPath(transaction, id, group.group_name, *group.path);
}

// Groups and holes of all the rows at once: two statements for a page.
absl::Status ReadChildren(Transaction& transaction, std::vector<CorrectionRow>* corrections) {
  const ParentRows<CorrectionRow> parents(corrections, &CorrectionRow::correction_id);
  if (parents.ids().empty()) return absl::OkStatus();
  const Params ids = Params().Uuids(parents.ids());
  const absl::Status groups = parents.Add(transaction.Execute(kSelectCorrectionGroups, ids),
                                          [](CorrectionRow& correction, const Rows& rows, int row) {
                                            CorrectionGroupRow& group = correction.groups.emplace_back();
                                            group.group_name = rows.Text(row, 1);
                                            group.a_deg = rows.Real(row, 2);
                                            group.b_deg = rows.Real(row, 3);
                                            group.a_nominal_deg = rows.Real(row, 4);
                                            group.b_nominal_deg = rows.Real(row, 5);
                                            group.a_ideal_deg = rows.Real(row, 6);
                                            group.b_ideal_deg = rows.Real(row, 7);
                                            group.a_standard_uncertainty_deg = rows.Real(row, 8);
                                            group.b_standard_uncertainty_deg = rows.Real(row, 9);
                                            if (!rows.IsNull(row, 10))
                                              group.reached_deg = {rows.Real(row, 10), rows.Real(row, 11)};
                                            if (!rows.IsNull(row, 12)) group.tilt_deg = rows.Real(row, 12);
                                          });
  if (!groups.ok()) return groups;
  const absl::Status checks = parents.Add(transaction.Execute(kSelectCorrectionChecks, ids),
                                          [](CorrectionRow& correction, const Rows& rows, int row) {
                                            CorrectionCheckRow& check = correction.checks.emplace_back();
                                            check.kind = rows.Text(row, 1);
                                            check.subject = rows.Text(row, 2);
                                            if (!rows.IsNull(row, 3)) check.value = rows.Real(row, 3);
                                            check.limit = rows.Real(row, 4);
                                            check.passed = rows.Bool(row, 5);
                                            check.failed_count = static_cast<int>(rows.Int(row, 6));
                                          });
  if (!checks.ok()) return checks;
  const absl::Status decisions =
      parents.Add(transaction.Execute(kSelectDecisions, ids), [](CorrectionRow& correction, const Rows& rows, int row) {
        (rows.Text(row, 1) == "RELEASED" ? correction.released : correction.refused) =
            CorrectionDecisionRow{rows.Text(row, 2), rows.Text(row, 3), rows.Time(row, 4)};
      });
  if (!decisions.ok()) return decisions;
  return parents.Add(transaction.Execute(kSelectCorrectionHoles, ids),
                     [](CorrectionRow& correction, const Rows& rows, int row) {
                       for (CorrectionGroupRow& group : correction.groups) {
                         if (group.group_name != rows.Text(row, 1)) continue;
                         CorrectionHoleRow& hole = group.holes.emplace_back();
                         hole.hole_name = rows.Text(row, 2);
                         hole.start_mm = {rows.Real(row, 3), rows.Real(row, 4), rows.Real(row, 5)};
                         hole.nominal_start_mm = {rows.Real(row, 6), rows.Real(row, 7), rows.Real(row, 8)};
                         hole.expanded_uncertainty_um = rows.Real(row, 9);
                         if (!rows.IsNull(row, 10)) hole.reported_cut_at = rows.Time(row, 10);
                         if (!rows.IsNull(row, 11)) hole.budget_um = rows.Reals(row, 11);
                       }
                     });
}

absl::StatusOr<std::vector<CorrectionRow>> ReadCorrections(Transaction& transaction, const char* sql,
                                                           const Params& params) {
  auto corrections = AllRows(transaction, sql, params, ReadCorrection);
  if (!corrections.ok()) return corrections;
  if (absl::Status status = ReadChildren(transaction, &*corrections); !status.ok()) return status;
  return corrections;
}

}  // namespace

std::shared_ptr<CorrectionStore> CorrectionsIn(Database* database) {
  using Store = PostgresResults<CorrectionRow, CorrectionFilter>;
  return std::make_shared<Store>(database, Store::Statements{InsertCorrection, FindCorrection, ListCorrections});
}

absl::StatusOr<Recorded> InsertCorrection(Transaction& transaction, const CorrectionRow& correction,
                                          const RecordEntry& entry) {
  KeptTexts kept;
  for (const auto& [text, digest] :
       {std::pair(&correction.nc_template, &kept.nc_template), std::pair(&correction.nc_program, &kept.nc_program),
        std::pair(&correction.nc_held, &kept.nc_held)}) {
    absl::StatusOr<std::optional<std::string>> sha256 = KeepText(transaction, *text);
    if (!sha256.ok()) return sha256.status();
    *digest = *std::move(sha256);
  }
  const auto inserted = transaction.Execute(kInsertCorrection, CorrectionParams(correction, kept));
  if (!inserted.ok()) return inserted.status();
  if (absl::Status checks = InsertChecks(transaction, correction); !checks.ok()) return checks;
  int position = 0;
  for (const CorrectionGroupRow& group : correction.groups) {
    if (absl::Status status = InsertGroup(transaction, correction.correction_id, position++, group); !status.ok())
      return status;
  }
  return AppendRecord(transaction, correction.correction_id, entry);
}

absl::StatusOr<std::optional<CorrectionRow>> FindCorrection(Transaction& transaction,
                                                            const std::string& correction_id) {
  auto rows = ReadCorrections(transaction, kSelectCorrection, Params().Uuid(correction_id));
  if (!rows.ok()) return rows.status();
  if (rows->empty()) return std::nullopt;
  CorrectionRow& correction = rows->front();
  if (!correction.program_sha256.empty()) {
    absl::StatusOr<std::string> text = GetBlob(transaction, correction.program_sha256);
    if (!text.ok()) return text.status();
    (correction.release == "AUTOMATIC" ? correction.nc_program : correction.nc_held) = *std::move(text);
  }
  auto paths = CorrectionToolPathsOf(transaction, correction_id);
  if (!paths.ok()) return paths.status();
  for (CorrectionGroupRow& group : correction.groups)
    if (const auto path = paths->find(group.group_name); path != paths->end()) group.path = std::move(path->second);
  return std::move(rows->front());
}

absl::StatusOr<std::vector<CorrectionRow>> ListCorrections(Transaction& transaction, const CorrectionFilter& filter,
                                                           std::int64_t before_sequence, int limit) {
  absl::StatusOr<Params> params = FilterParams(transaction, before_sequence, filter);
  if (!params.ok()) return params.status();
  return ReadCorrections(transaction, kListCorrections, params->Text(filter.release).Text(filter.state).Int(limit));
}

}  // namespace sixpoint::storage
