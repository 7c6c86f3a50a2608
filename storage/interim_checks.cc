#include "storage/interim_checks.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertInterimCheck[] =
    "INSERT INTO interim_checks (study_id, sensor_calibration_id, clamping, scanned_at) VALUES ($1, $2, $3, $4)";
constexpr char kSelectInterimState[] =
    "SELECT study_id, verdict, (SELECT max(a.scanned_at) FROM interim_checks a JOIN studies s USING (study_id) "
    "WHERE a.sensor_calibration_id = $1 AND s.verdict = 'ACCEPTED') "
    "FROM interim_checks i JOIN studies USING (study_id) JOIN record_names n ON n.record_id = study_id "
    "WHERE i.sensor_calibration_id = $1 AND verdict <> 'REPORTED' ORDER BY record_sequence DESC LIMIT 1";

}  // namespace

absl::Status InsertInterimCheck(Transaction& transaction, const std::string& study_id, const InterimCheckRow& check) {
  Params params;
  params.Uuid(study_id).Uuid(check.sensor_calibration_id).OptionalText(check.clamping).Time(check.scanned_at);
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
