#include "storage/assessments.h"

#include <utility>

#include "storage/children.h"
#include "storage/each_row.h"
#include "storage/postgres_results.h"
#include "storage/three.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_ASSESSMENT_COLUMNS                                                                                   \
  "assessment_id, blade_serial, machine_id, machine_revision, part_id, part_revision, drawing_id, drawing_revision, " \
  "stage, verdict, fate, fate_reason, requested_by, software_version, computed_on"
constexpr char kInsertAssessment[] = "INSERT INTO assessments (" SIXPOINT_ASSESSMENT_COLUMNS
                                     ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15)";
#define SIXPOINT_SELECT_ASSESSMENTS                                                                            \
  "SELECT " SIXPOINT_ASSESSMENT_COLUMNS                                                                        \
  ", record_sequence, recorded_at, name_of(requested_by), entry_order, entry_operation FROM assessments JOIN " \
  "recorded r ON r.record_id = assessment_id WHERE "
constexpr char kSelectAssessment[] = SIXPOINT_SELECT_ASSESSMENTS "assessment_id = $1";
// As SIXPOINT_RESULT_FILTER, but for the calibration, which it rests on by its results.
constexpr char kListAssessments[] = SIXPOINT_SELECT_ASSESSMENTS
    "entry_kind = 'assessment' AND ($1::bigint = 0 OR record_sequence < $1::bigint) AND ($2 = '' OR entry_blade = $2) "
    "AND ($3 = '' OR entry_machine = $3) AND ($4 = '' OR part_id = $4) AND ($5::uuid IS NULL OR EXISTS (SELECT 1 FROM "
    "record_roots t WHERE t.record_id = assessment_id AND t.root_id = $5::uuid)) AND ($6::timestamptz IS NULL OR "
    "recorded_at >= $6) AND ($7::timestamptz IS NULL OR recorded_at < $7) AND part_id <> ALL ($8::text[]) AND "
    "($9::text[] IS NULL OR entry_blade = ANY ($9::text[])) AND ($10 = '' OR verdict = $10) "
    "AND ($11 = '' OR drawing_id = $11) AND ($12::integer = 0 OR drawing_revision = "
    "$12::integer) " SIXPOINT_NEWEST_FIRST "LIMIT $13";
#undef SIXPOINT_SELECT_ASSESSMENTS
#undef SIXPOINT_ASSESSMENT_COLUMNS
constexpr char kInsertResults[] =
    "INSERT INTO assessment_results (assessment_id, position_index, result_id) SELECT $1::uuid, (position - "
    "1)::integer, n.record_id FROM unnest($2::text[]) WITH ORDINALITY AS results (name, position) JOIN record_names n "
    "ON n.name = results.name";
constexpr char kSelectResults[] =
    "SELECT assessment_id, n.name FROM assessment_results JOIN record_names n ON n.record_id = result_id WHERE "
    "assessment_id = ANY ($1::uuid[]) ORDER BY assessment_id, position_index";
constexpr char kInsertFindings[] =
    "INSERT INTO assessment_findings (assessment_id, position_index, characteristic, feature, place, name, class, "
    "quantity, unit, nominal, lower_limit, upper_limit, value, expanded_uncertainty, verdict, decision_rule, "
    "decision_rule_edition, guard_factor, reason, result_index, method, cure) SELECT $1::uuid, (position - "
    "1)::integer, characteristic, feature, place, name, class, quantity, unit, nominal, lower_limit, upper_limit, "
    "value, expanded, verdict, rule, NULLIF(edition, ''), guard_factor, reason, result::integer, NULLIF(method, ''), "
    "NULLIF(cure, '') FROM unnest($2::text[], $3::text[], $4::text[], $5::text[], $6::text[], $7::text[], $8::text[], "
    "$9::double precision[], $10::double precision[], $11::double precision[], $12::double precision[], $13::double "
    "precision[], $14::text[], $15::text[], $16::text[], $17::double precision[], $18::text[], $19::double "
    "precision[], $20::text[], $21::text[]) WITH ORDINALITY AS one (characteristic, feature, place, name, class, "
    "quantity, unit, nominal, lower_limit, upper_limit, value, expanded, verdict, rule, edition, guard_factor, reason, "
    "result, method, cure, position)";
constexpr char kSelectFindings[] =
    "SELECT assessment_id, characteristic, feature, place, name, class, quantity, unit, nominal, lower_limit, "
    "upper_limit, value, expanded_uncertainty, verdict, decision_rule, decision_rule_edition, guard_factor, reason, "
    "result_index, method, cure FROM assessment_findings WHERE assessment_id = ANY ($1::uuid[]) ORDER BY "
    "assessment_id, position_index";
constexpr char kInsertOthers[] =
    "INSERT INTO assessment_others (assessment_id, finding_index, position_index, result_index, method, value, "
    "expanded_uncertainty) SELECT $1::uuid, finding::integer, place::integer, result::integer, NULLIF(method, ''), "
    "value, expanded FROM unnest($2::double precision[], $3::double precision[], $4::double precision[], $5::text[], "
    "$6::double precision[], $7::double precision[]) AS one (finding, place, result, method, value, expanded)";
constexpr char kSelectOthers[] =
    "SELECT assessment_id, finding_index, result_index, method, value, expanded_uncertainty FROM assessment_others "
    "WHERE assessment_id = ANY ($1::uuid[]) ORDER BY assessment_id, finding_index, position_index";
constexpr char kInsertConflict[] =
    "INSERT INTO assessment_conflicts (assessment_id, position_index, characteristic, result_index, patch, mean_um, "
    "expanded_uncertainty_um, centre_in_part_mm, above, share) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)";
constexpr char kSelectConflicts[] =
    "SELECT assessment_id, characteristic, result_index, patch, mean_um, expanded_uncertainty_um, centre_in_part_mm, "
    "above, share FROM assessment_conflicts WHERE assessment_id = ANY ($1::uuid[]) ORDER BY assessment_id, "
    "position_index";

Params AssessmentParams(const AssessmentRow& row) {
  Params params;
  params.Uuid(row.assessment_id).Text(row.blade_serial).OptionalText(row.machine_id);
  row.machine_id.empty() ? params.Null() : params.Int(row.machine_revision);
  params.Text(row.part_id).Int(row.part_revision).Text(row.drawing_id).Int(row.drawing_revision).Text(row.stage);
  params.Text(row.verdict).OptionalText(row.fate).Text(row.fate_reason);
  return params.Text(row.requested_by).Text(row.software_version).Text(row.computed_on);
}

AssessmentRow ReadAssessment(const Rows& rows, int row) {
  AssessmentRow assessment;
  assessment.assessment_id = rows.Text(row, 0);
  assessment.blade_serial = rows.Text(row, 1);
  assessment.machine_id = rows.OptionalText(row, 2);
  if (!assessment.machine_id.empty()) assessment.machine_revision = static_cast<int>(rows.Int(row, 3));
  assessment.part_id = rows.Text(row, 4);
  assessment.part_revision = static_cast<int>(rows.Int(row, 5));
  assessment.drawing_id = rows.Text(row, 6);
  assessment.drawing_revision = static_cast<int>(rows.Int(row, 7));
  assessment.stage = rows.Text(row, 8);
  assessment.verdict = rows.Text(row, 9);
  assessment.fate = rows.OptionalText(row, 10);
  assessment.fate_reason = rows.Text(row, 11);
  assessment.software_version = rows.Text(row, 13);
  assessment.computed_on = rows.Text(row, 14);
  assessment.recorded = {rows.Int(row, 15), rows.Time(row, 16)};
  assessment.requested_by = rows.Text(row, 17);
  assessment.work_order = rows.OptionalText(row, 18);
  assessment.operation = rows.OptionalText(row, 19);
  return assessment;
}

// A column of one member of each.
template <typename Value, typename Rows, typename Of>
std::vector<Value> ColumnOf(const Rows& rows, const Of& of) {
  std::vector<Value> column;
  column.reserve(rows.size());
  for (const auto& row : rows) column.push_back(of(row));
  return column;
}

Params FindingsParams(const AssessmentRow& assessment) {
  using Row = CharacteristicFindingRow;
  const auto texts = [&](std::string Row::*member) {
    return ColumnOf<std::string>(assessment.findings, [&](const Row& row) { return row.*member; });
  };
  const auto reals = [&](std::optional<double> Row::*member) {
    return ColumnOf<std::optional<double>>(assessment.findings, [&](const Row& row) { return row.*member; });
  };
  Params params;
  params.Uuid(assessment.assessment_id).Texts(texts(&Row::characteristic)).Texts(texts(&Row::feature));
  params.Texts(texts(&Row::place)).Texts(texts(&Row::name)).Texts(texts(&Row::characteristic_class));
  params.Texts(texts(&Row::quantity)).Texts(texts(&Row::unit)).OptionalReals(reals(&Row::nominal));
  params.OptionalReals(reals(&Row::lower_limit)).OptionalReals(reals(&Row::upper_limit));
  params.OptionalReals(reals(&Row::value)).OptionalReals(reals(&Row::expanded_uncertainty));
  params.Texts(texts(&Row::verdict));
  params.Texts(ColumnOf<std::string>(assessment.findings, [](const Row& row) { return row.rule.kind; }));
  params.Texts(ColumnOf<std::string>(assessment.findings, [](const Row& row) { return row.rule.edition; }));
  params.OptionalReals(
      ColumnOf<std::optional<double>>(assessment.findings, [](const Row& row) { return row.rule.guard_factor; }));
  params.Texts(texts(&Row::reason));
  params.OptionalReals(ColumnOf<std::optional<double>>(assessment.findings, [](const Row& row) {
    return row.result_index ? std::optional<double>(*row.result_index) : std::nullopt;
  }));
  return params.Texts(texts(&Row::method)).Texts(texts(&Row::cure));
}

CharacteristicFindingRow ReadFinding(const Rows& rows, int row) {
  CharacteristicFindingRow finding;
  int column = 1;
  for (std::string* text : {&finding.characteristic, &finding.feature, &finding.place, &finding.name,
                            &finding.characteristic_class, &finding.quantity, &finding.unit})
    *text = rows.Text(row, column++);
  for (std::optional<double>* real :
       {&finding.nominal, &finding.lower_limit, &finding.upper_limit, &finding.value, &finding.expanded_uncertainty})
    *real = rows.OptionalReal(row, column++);
  finding.verdict = rows.Text(row, column);
  finding.rule = DecisionRuleAt(rows, row, column + 1);
  finding.reason = rows.Text(row, column + 4);
  if (!rows.IsNull(row, column + 5)) finding.result_index = static_cast<int>(rows.Int(row, column + 5));
  finding.method = rows.OptionalText(row, column + 6);
  finding.cure = rows.OptionalText(row, column + 7);
  return finding;
}

Params OthersParams(const AssessmentRow& assessment) {
  std::vector<double> findings, places, results, values;
  std::vector<std::string> methods;
  std::vector<std::optional<double>> expanded;
  for (std::size_t i = 0; i < assessment.findings.size(); ++i)
    for (std::size_t k = 0; k < assessment.findings[i].others.size(); ++k) {
      const OtherValueRow& other = assessment.findings[i].others[k];
      findings.push_back(static_cast<double>(i));
      places.push_back(static_cast<double>(k));
      results.push_back(other.result_index);
      methods.push_back(other.method);
      values.push_back(other.value);
      expanded.push_back(other.expanded_uncertainty);
    }
  Params params;
  params.Uuid(assessment.assessment_id).Reals(findings).Reals(places).Reals(results).Texts(methods);
  return params.Reals(values).OptionalReals(expanded);
}

absl::Status ReadChildren(Transaction& transaction, const ParentRows<AssessmentRow>& parents) {
  const Params ids = Params().Uuids(parents.ids());
  absl::Status read = parents.Add(
      transaction.Execute(kSelectResults, ids),
      [](AssessmentRow& assessment, const Rows& rows, int row) { assessment.results.push_back(rows.Text(row, 1)); });
  if (read.ok())
    read = parents.Add(transaction.Execute(kSelectFindings, ids),
                       [](AssessmentRow& assessment, const Rows& rows, int row) {
                         assessment.findings.push_back(ReadFinding(rows, row));
                       });
  if (read.ok())
    read = parents.Add(
        transaction.Execute(kSelectConflicts, ids), [](AssessmentRow& assessment, const Rows& rows, int row) {
          assessment.conflicts.push_back({rows.Text(row, 1), static_cast<int>(rows.Int(row, 2)),
                                          static_cast<int>(rows.Int(row, 3)), rows.Real(row, 4), rows.Real(row, 5),
                                          ThreeOf(rows.Reals(row, 6)), rows.Bool(row, 7), rows.Real(row, 8)});
        });
  if (!read.ok()) return read;
  return parents.Add(transaction.Execute(kSelectOthers, ids), [](AssessmentRow& assessment, const Rows& rows, int row) {
    const auto finding = static_cast<std::size_t>(rows.Int(row, 1));
    if (finding >= assessment.findings.size()) return;  // its foreign key holds it
    assessment.findings[finding].others.push_back(
        {static_cast<int>(rows.Int(row, 2)), rows.OptionalText(row, 3), rows.Real(row, 4), rows.OptionalReal(row, 5)});
  });
}

absl::StatusOr<std::vector<AssessmentRow>> ReadAssessments(Transaction& transaction, const char* sql,
                                                           const Params& params) {
  auto assessments = AllRows(transaction, sql, params, ReadAssessment);
  if (!assessments.ok() || assessments->empty()) return assessments;
  const ParentRows<AssessmentRow> parents(&*assessments, &AssessmentRow::assessment_id);
  if (absl::Status read = ReadChildren(transaction, parents); !read.ok()) return read;
  return assessments;
}

absl::StatusOr<std::optional<AssessmentRow>> FindAssessment(Transaction& transaction, const std::string& id) {
  return FirstOf(ReadAssessments(transaction, kSelectAssessment, Params().Uuid(id)));
}

absl::StatusOr<std::vector<AssessmentRow>> ListAssessments(Transaction& transaction, const AssessmentFilter& filter,
                                                           std::int64_t before_sequence, int limit) {
  absl::StatusOr<Params> params = FilterParams(transaction, before_sequence, filter);
  if (!params.ok()) return params.status();
  return ReadAssessments(transaction, kListAssessments,
                         params->Text(filter.verdict).Text(filter.drawing_id).Int(filter.drawing_revision).Int(limit));
}

absl::Status InsertConflicts(Transaction& transaction, const AssessmentRow& assessment) {
  for (std::size_t i = 0; i < assessment.conflicts.size(); ++i) {
    const LimitConflictRow& one = assessment.conflicts[i];
    Params params;
    params.Uuid(assessment.assessment_id).Int(static_cast<std::int64_t>(i)).Text(one.characteristic);
    params.Int(one.result_index).Int(one.patch).Real(one.mean_um).Real(one.expanded_uncertainty_um);
    params.Reals({one.centre_in_part_mm.begin(), one.centre_in_part_mm.end()}).Bool(one.above).Real(one.share);
    if (absl::Status status = transaction.Execute(kInsertConflict, params).status(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Recorded> InsertAssessment(Transaction& transaction, const AssessmentRow& assessment,
                                          const RecordEntry& entry) {
  const std::string& id = assessment.assessment_id;
  absl::Status status = transaction.Execute(kInsertAssessment, AssessmentParams(assessment)).status();
  if (status.ok()) status = transaction.Execute(kInsertResults, Params().Uuid(id).Texts(assessment.results)).status();
  if (status.ok()) status = transaction.Execute(kInsertFindings, FindingsParams(assessment)).status();
  if (status.ok()) status = transaction.Execute(kInsertOthers, OthersParams(assessment)).status();
  if (status.ok()) status = InsertConflicts(transaction, assessment);
  if (!status.ok()) return status;
  return AppendRecord(transaction, id, entry);
}

std::shared_ptr<AssessmentStore> AssessmentsIn(Database* database) {
  using Results = PostgresResults<AssessmentRow, AssessmentFilter>;
  return std::make_shared<Results>(database, Results::Statements{InsertAssessment, FindAssessment, ListAssessments});
}

}  // namespace sixpoint::storage
