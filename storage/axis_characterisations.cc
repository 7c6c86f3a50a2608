#include "storage/axis_characterisations.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_COLUMNS                                                                                     \
  "characterisation_id, machine_id, axis, inputs, request_sha256, reading_count, reversal_deg, mean_deg, "   \
  "long_wave_order, long_wave_amplitude_deg, periodic_order, periodic_amplitude_deg, least_detectable_deg, " \
  "greatest_error_deg, greatest_error_at_deg, greatest_error_forward, standard_uncertainty_deg, "            \
  "compensated_standard_uncertainty_deg, noise_deg, forward_error_deg, backward_error_deg, "                 \
  "table_standard_uncertainty_deg, requested_by, software_version, record_sequence, recorded_at"

constexpr char kInsert[] = "INSERT INTO axis_characterisations (" SIXPOINT_COLUMNS
                           ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, "
                           "$19, $20, $21, $22, $23, $24, $25, $26)";
constexpr char kSelect[] = "SELECT " SIXPOINT_COLUMNS " FROM axis_characterisations WHERE characterisation_id = $1";
constexpr char kSelectPage[] = "SELECT " SIXPOINT_COLUMNS
                               " FROM axis_characterisations WHERE ($1 = '' OR machine_id = $1) "
                               "AND ($2 = '' OR axis = $2) AND ($3::bigint = 0 OR record_sequence < $3::bigint) "
                               "ORDER BY record_sequence DESC LIMIT $4";
#undef SIXPOINT_COLUMNS

std::vector<double> Pair(const AngleEstimateRow& estimate) {
  return {estimate.value_deg, estimate.standard_uncertainty_deg};
}

AngleEstimateRow EstimateAt(const Rows& rows, int row, int column) {
  const std::vector<double> pair = rows.Reals(row, column);
  return {pair.at(0), pair.at(1)};
}

AxisCharacterisationRow Read(const Rows& rows, int row) {
  AxisCharacterisationRow a;
  a.characterisation_id = rows.Text(row, 0);
  a.machine_id = rows.Text(row, 1);
  a.axis = rows.Text(row, 2);
  a.inputs = rows.Texts(row, 3);
  a.request_sha256 = rows.Text(row, 4);
  a.reading_count = static_cast<int>(rows.Int(row, 5));
  a.reversal = EstimateAt(rows, row, 6);
  a.mean = EstimateAt(rows, row, 7);
  a.long_wave_order = static_cast<int>(rows.Int(row, 8));
  a.long_wave_amplitude = EstimateAt(rows, row, 9);
  if (!rows.IsNull(row, 10)) {
    a.periodic_order = static_cast<int>(rows.Int(row, 10));
    a.periodic_amplitude = EstimateAt(rows, row, 11);
  }
  a.least_detectable_deg = rows.Real(row, 12);
  a.greatest_error = EstimateAt(rows, row, 13);
  a.greatest_error_at_deg = rows.Real(row, 14);
  a.greatest_error_forward = rows.Bool(row, 15);
  a.standard_uncertainty = EstimateAt(rows, row, 16);
  a.compensated_standard_uncertainty = EstimateAt(rows, row, 17);
  a.noise = EstimateAt(rows, row, 18);
  a.forward_error_deg = rows.Reals(row, 19);
  a.backward_error_deg = rows.Reals(row, 20);
  a.table_standard_uncertainty_deg = rows.Real(row, 21);
  a.requested_by = rows.Text(row, 22);
  a.software_version = rows.Text(row, 23);
  a.recorded = {rows.Int(row, 24), rows.Time(row, 25)};
  return a;
}

}  // namespace

absl::StatusOr<Recorded> InsertAxisCharacterisation(Transaction& transaction, const AxisCharacterisationRow& a,
                                                    const std::string& summary_json) {
  RecordEntry entry;
  entry.kind = "calibration";
  entry.name = "characterisations/" + a.characterisation_id;
  entry.inputs = a.inputs;
  entry.machine = a.machine_id;
  entry.method = "ENCODER_RUN";
  entry.software_version = a.software_version;
  entry.requested_by = a.requested_by;
  entry.summary_json = summary_json;
  const absl::StatusOr<Recorded> recorded = AppendRecord(transaction, entry);
  if (!recorded.ok()) return recorded.status();
  Params params;
  params.Text(a.characterisation_id).Text(a.machine_id).Text(a.axis).Texts(a.inputs).Text(a.request_sha256);
  params.Int(a.reading_count).Reals(Pair(a.reversal)).Reals(Pair(a.mean)).Int(a.long_wave_order);
  params.Reals(Pair(a.long_wave_amplitude));
  if (a.periodic_order)
    params.Int(*a.periodic_order).Reals(Pair(a.periodic_amplitude));
  else
    params.Null().Null();
  params.Real(a.least_detectable_deg).Reals(Pair(a.greatest_error)).Real(a.greatest_error_at_deg);
  params.Bool(a.greatest_error_forward).Reals(Pair(a.standard_uncertainty));
  params.Reals(Pair(a.compensated_standard_uncertainty)).Reals(Pair(a.noise)).Reals(a.forward_error_deg);
  params.Reals(a.backward_error_deg).Real(a.table_standard_uncertainty_deg).Text(a.requested_by);
  params.Text(a.software_version).Int(recorded->sequence).Time(recorded->recorded_at);
  const absl::StatusOr<Rows> inserted = transaction.Execute(kInsert, params);
  if (!inserted.ok()) return inserted.status();
  return recorded;
}

absl::StatusOr<std::optional<AxisCharacterisationRow>> FindAxisCharacterisation(Transaction& transaction,
                                                                                const std::string& id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelect, Params().Text(id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return Read(*rows, 0);
}

absl::StatusOr<std::vector<AxisCharacterisationRow>> ListAxisCharacterisations(Transaction& transaction,
                                                                               const std::string& machine_id,
                                                                               const std::string& axis,
                                                                               std::int64_t before_sequence,
                                                                               int limit) {
  const absl::StatusOr<Rows> rows =
      transaction.Execute(kSelectPage, Params().Text(machine_id).Text(axis).Int(before_sequence).Int(limit));
  if (!rows.ok()) return rows.status();
  std::vector<AxisCharacterisationRow> found;
  for (int row = 0; row < rows->count(); ++row) found.push_back(Read(*rows, row));
  return found;
}

}  // namespace sixpoint::storage
