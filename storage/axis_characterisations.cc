#include "storage/axis_characterisations.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_FIGURES                                                                                \
  "reading_count, reversal_deg, mean_deg, long_wave_order, long_wave_amplitude_deg, periodic_order, "   \
  "periodic_amplitude_deg, least_detectable_deg, greatest_error_deg, greatest_error_at_deg, "           \
  "greatest_error_forward, standard_uncertainty_deg, compensated_standard_uncertainty_deg, noise_deg, " \
  "table_standard_uncertainty_deg, beyond_limits_count"
constexpr char kInsertAxis[] =
    "INSERT INTO axis_characterisations (calibration_id, forward_error_deg, backward_error_deg, " SIXPOINT_FIGURES
    ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19)";
constexpr char kSelectAxes[] =
    "SELECT calibration_id, axis, " SIXPOINT_FIGURES
    " FROM axis_characterisations JOIN calibrations USING (calibration_id) WHERE calibration_id = ANY ($1::uuid[])";
constexpr char kSelectTable[] =
    "SELECT forward_error_deg, backward_error_deg FROM axis_characterisations WHERE calibration_id = $1";
#undef SIXPOINT_FIGURES

std::vector<double> Pair(const AngleEstimateRow& estimate) {
  return {estimate.value_deg, estimate.standard_uncertainty_deg};
}

AngleEstimateRow EstimateAt(const Rows& rows, int row, int column) {
  const std::vector<double> pair = rows.Reals(row, column);
  return {pair.at(0), pair.at(1)};
}

AxisCharacterisationRow ReadAxis(const Rows& rows, int row) {
  AxisCharacterisationRow a;
  a.axis = rows.Text(row, 1);
  a.reading_count = static_cast<int>(rows.Int(row, 2));
  a.reversal = EstimateAt(rows, row, 3);
  a.mean = EstimateAt(rows, row, 4);
  a.long_wave_order = static_cast<int>(rows.Int(row, 5));
  a.long_wave_amplitude = EstimateAt(rows, row, 6);
  if (!rows.IsNull(row, 7)) {
    a.periodic_order = static_cast<int>(rows.Int(row, 7));
    a.periodic_amplitude = EstimateAt(rows, row, 8);
  }
  a.least_detectable_deg = rows.Real(row, 9);
  a.greatest_error = EstimateAt(rows, row, 10);
  a.greatest_error_at_deg = rows.Real(row, 11);
  a.greatest_error_forward = rows.Bool(row, 12);
  a.standard_uncertainty = EstimateAt(rows, row, 13);
  a.compensated_standard_uncertainty = EstimateAt(rows, row, 14);
  a.noise = EstimateAt(rows, row, 15);
  a.table_standard_uncertainty_deg = rows.Real(row, 16);
  if (!rows.IsNull(row, 17)) a.beyond_limits_count = static_cast<int>(rows.Int(row, 17));
  return a;
}

}  // namespace

absl::Status InsertAxis(Transaction& transaction, const std::string& id, const AxisCharacterisationRow& a) {
  Params params;
  params.Uuid(id).Reals(a.forward_error_deg).Reals(a.backward_error_deg).Int(a.reading_count);
  params.Reals(Pair(a.reversal)).Reals(Pair(a.mean)).Int(a.long_wave_order).Reals(Pair(a.long_wave_amplitude));
  if (a.periodic_order)
    params.Int(*a.periodic_order).Reals(Pair(a.periodic_amplitude));
  else
    params.Null().Null();
  params.Real(a.least_detectable_deg).Reals(Pair(a.greatest_error)).Real(a.greatest_error_at_deg);
  params.Bool(a.greatest_error_forward).Reals(Pair(a.standard_uncertainty));
  params.Reals(Pair(a.compensated_standard_uncertainty)).Reals(Pair(a.noise)).Real(a.table_standard_uncertainty_deg);
  params.OptionalInt(a.beyond_limits_count);
  return transaction.Execute(kInsertAxis, params).status();
}

absl::Status ReadAxes(Transaction& transaction, const std::vector<std::string>& calibration_ids,
                      std::vector<CalibrationRow>* calibrations) {
  const absl::StatusOr<Rows> axes = transaction.Execute(kSelectAxes, Params().Uuids(calibration_ids));
  if (!axes.ok()) return axes.status();
  for (CalibrationRow& c : *calibrations)
    for (int row = 0; row < axes->count(); ++row)
      if (axes->Text(row, 0) == c.calibration_id) c.axis = ReadAxis(*axes, row);
  return axes->status();
}

absl::Status ReadAxisTable(Transaction& transaction, const std::string& calibration_id, AxisCharacterisationRow* axis) {
  const absl::StatusOr<Rows> table = transaction.Execute(kSelectTable, Params().Uuid(calibration_id));
  if (!table.ok()) return table.status();
  if (table->count() != 1) return absl::DataLossError("characterisation " + calibration_id + ": its table is gone");
  axis->forward_error_deg = table->Reals(0, 0);
  axis->backward_error_deg = table->Reals(0, 1);
  return table->status();
}

}  // namespace sixpoint::storage
