#include "storage/interim_checks.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertInterimCheck[] =
    "INSERT INTO interim_checks (study_id, sensor_calibration_id, clamping, scanned_at, limit_um) "
    "VALUES ($1, $2, $3, $4, $5)";
constexpr char kSelectInterimState[] =
    "WITH judged AS (SELECT study_id, verdict, scanned_at, limit_um, record_sequence FROM interim_checks "
    "JOIN studies USING (study_id) JOIN record_names ON record_id = study_id "
    "WHERE sensor_calibration_id = $1 AND verdict <> 'REPORTED'), "
    "standing AS (SELECT * FROM judged r WHERE verdict <> 'ACCEPTED' AND NOT EXISTS (SELECT 1 FROM judged a "
    "WHERE a.verdict = 'ACCEPTED' AND a.limit_um <= r.limit_um "
    "AND (a.scanned_at, a.record_sequence) > (r.scanned_at, r.record_sequence))) "
    "SELECT study_id, verdict, (SELECT max(scanned_at) FROM judged WHERE verdict = 'ACCEPTED' "
    "AND limit_um <= coalesce((SELECT min(limit_um) FROM standing), limit_um)) "
    "FROM (SELECT *, 0 AS place FROM standing UNION ALL SELECT *, 1 FROM judged) AS checks "
    "ORDER BY place, scanned_at DESC, record_sequence DESC LIMIT 1";

}  // namespace

absl::Status InsertInterimCheck(Transaction& transaction, const std::string& study_id, const InterimCheckRow& check) {
  Params params;
  params.Uuid(study_id).Uuid(check.sensor_calibration_id).OptionalText(check.clamping).Time(check.scanned_at);
  params.Real(check.limit_um);
  return transaction.Execute(kInsertInterimCheck, params).status();
}

absl::StatusOr<std::optional<InterimStateRow>> InterimStateOf(Transaction& transaction,
                                                              const std::string& sensor_calibration_id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectInterimState, Params().Uuid(sensor_calibration_id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  InterimStateRow state{rows->Text(0, 0), rows->Text(0, 1), std::nullopt};
  if (!rows->IsNull(0, 2)) state.stood_until = rows->Time(0, 2);
  return rows->Checked(std::optional(std::move(state)));
}

}  // namespace sixpoint::storage
