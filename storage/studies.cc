#include "storage/studies.h"

#include "storage/blobs.h"
#include "storage/clearances.h"
#include "storage/postgres_results.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_STUDY_COLUMNS                                                                         \
  "study_id, machine_id, kind, inputs, request_sha256, verdict, result, temperature_c, requested_by, " \
  "software_version"
constexpr char kInsertStudy[] =
    "INSERT INTO studies (" SIXPOINT_STUDY_COLUMNS ") VALUES ($1, $2, $3, $4, $5, $6, $7::jsonb, $8, $9, $10)";
#define SIXPOINT_SELECT_STUDIES                                                                                       \
  "SELECT " SIXPOINT_STUDY_COLUMNS                                                                                    \
  ", record_sequence, recorded_at, name_of(requested_by) FROM studies JOIN record_names n ON n.record_id = study_id " \
  "WHERE "
constexpr char kSelectStudy[] = SIXPOINT_SELECT_STUDIES "study_id = $1";
constexpr char kSelectStudies[] = SIXPOINT_SELECT_STUDIES
    "($1 = '' OR machine_id = $1) AND ($2 = '' OR kind = $2) AND ($3 = '' OR verdict = $3) "
    "AND ($4::timestamptz IS NULL OR recorded_at >= $4) AND ($5::timestamptz IS NULL OR recorded_at < $5) "
    "AND ($6::bigint = 0 OR record_sequence < $6::bigint) AND (cardinality($7::text[]) = 0 OR "
    "coalesce(NOT parts_of_record(study_id) && $7::text[], false)) AND (($8::uuid IS NULL AND $9 = '') OR "
    "EXISTS (SELECT 1 FROM interim_checks i WHERE i.study_id = studies.study_id AND "
    "($8::uuid IS NULL OR i.sensor_calibration_id = $8::uuid) AND ($9 = '' OR i.clamping = $9))) "
    "ORDER BY record_sequence DESC LIMIT $10";
#undef SIXPOINT_SELECT_STUDIES
#undef SIXPOINT_STUDY_COLUMNS

std::vector<StudyRow> ReadStudies(const Rows& rows) {
  std::vector<StudyRow> studies;
  for (int row = 0; row < rows.count(); ++row) {
    StudyRow& s = studies.emplace_back();
    s.study_id = rows.Text(row, 0);
    if (!rows.IsNull(row, 1)) s.machine_id = rows.Text(row, 1);
    s.kind = rows.Text(row, 2);
    s.inputs = rows.Texts(row, 3);
    s.verdict = rows.Text(row, 5);
    s.result_json = rows.Text(row, 6);
    if (!rows.IsNull(row, 7)) s.temperature_c = rows.Real(row, 7);
    s.requested_by = rows.Text(row, 12);
    s.software_version = rows.Text(row, 9);
    s.recorded = {rows.Int(row, 10), rows.Time(row, 11)};
  }
  return studies;
}

}  // namespace

std::shared_ptr<StudyStore> StudiesIn(Database* database) {
  using Store = PostgresResults<StudyRow, StudyFilter>;
  return std::make_shared<Store>(database, Store::Statements{InsertStudy, FindStudy, ListStudies});
}

absl::StatusOr<Recorded> InsertStudy(Transaction& transaction, const StudyRow& study, const RecordEntry& entry) {
  const absl::StatusOr<std::string> request_sha256 = PutBlob(transaction, study.request_bytes);
  if (!request_sha256.ok()) return request_sha256.status();
  Params params;
  params.Uuid(study.study_id);
  params.OptionalText(study.machine_id);
  params.Text(study.kind).Texts(study.inputs).Digest(*request_sha256).Text(study.verdict).Json(study.result_json);
  study.temperature_c ? params.Real(*study.temperature_c) : params.Null();
  params.Text(study.requested_by).Text(study.software_version);
  const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertStudy, params);
  if (!inserted.ok()) return inserted.status();
  if (study.interim_check)
    if (absl::Status s = InsertInterimCheck(transaction, study.study_id, *study.interim_check); !s.ok()) return s;
  return AppendRecord(transaction, study.study_id, entry);
}

absl::StatusOr<std::optional<StudyRow>> FindStudy(Transaction& transaction, const std::string& study_id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectStudy, Params().Uuid(study_id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return rows->Checked(ReadStudies(*rows).front());
}

absl::StatusOr<std::vector<StudyRow>> ListStudies(Transaction& transaction, const StudyFilter& filter,
                                                  std::int64_t before_sequence, int limit) {
  Params params;
  params.Text(filter.machine_id).Text(filter.kind).Text(filter.verdict);
  AddSpan(filter.recorded, &params);
  const absl::StatusOr<Sight> sight = SightOf(transaction, filter.reader);
  if (!sight.ok()) return sight.status();
  params.Int(before_sequence).Texts(sight->hidden_parts);
  filter.sensor_calibration_id.empty() ? params.Null() : params.Uuid(filter.sensor_calibration_id);
  params.Text(filter.clamping);
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectStudies, params.Int(limit));
  if (!rows.ok()) return rows.status();
  return rows->Checked(ReadStudies(*rows));
}

}  // namespace sixpoint::storage
