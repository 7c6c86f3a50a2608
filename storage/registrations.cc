#include "storage/registrations.h"

#include <utility>

#include "storage/children.h"
#include "storage/each_row.h"
#include "storage/postgres_results.h"
#include "storage/scan_keys.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_REGISTRATION_COLUMNS                                                                             \
  "registration_id, blade_serial, machine_id, machine_revision, part_id, part_revision, method, "                 \
  "sensor_calibration_id, rotation_calibration_id, outcome, zero_from_part, reference_mm, covariance, "           \
  "noise_covariance, calibration_sensitivity, point_count, points_used, iteration_count, residual_rms_um, "       \
  "residual_sigma_um, condition_number, weakest_direction, weakest_standard_uncertainty_um, remark, "             \
  "compute_seconds, requested_by, software_version, weakest_direction_in_words, "                                 \
  "noise_sigma_um, model_sigma_um, information_kept, surface_part, least_stock_mm, lacking_mm, disagreement_um, " \
  "disagreement_ratio, disagrees, for_inspection, clamping, thermal_stretch, sensor_calibration_asked, "          \
  "scans_received_at, computed_on, station"
constexpr char kInsertRegistration[] =
    "INSERT INTO registrations (" SIXPOINT_REGISTRATION_COLUMNS
    ", options, detail) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, "
    "$20, $21, $22, $23, $24, $25, $26, $27, $28, $29, $30, $31, $32, $33, $34, $35, $36, $37, $38, $39, "
    "$40, $41, $42, $43, $44, $45::jsonb, $46::jsonb)";
#define SIXPOINT_SELECT_REGISTRATIONS                                                                           \
  "SELECT " SIXPOINT_REGISTRATION_COLUMNS                                                                       \
  ", options::text, detail::text, record_sequence, recorded_at, name_of(requested_by) FROM registrations JOIN " \
  "recorded r ON "                                                                                              \
  "r.record_id = registration_id WHERE "
constexpr char kSelectRegistration[] = SIXPOINT_SELECT_REGISTRATIONS "registration_id = $1";
constexpr char kListRegistrations[] =
    SIXPOINT_SELECT_REGISTRATIONS SIXPOINT_RESULT_FILTER("registrations", "registration")
    "AND ($10 = '' OR outcome = $10) AND (NOT $11::boolean OR disagrees) AND NOT ($12::boolean AND for_inspection) "
    SIXPOINT_NEWEST_FIRST "LIMIT $13";
#undef SIXPOINT_SELECT_REGISTRATIONS
#undef SIXPOINT_REGISTRATION_COLUMNS
constexpr char kInsertRegistrationScan[] =
    "INSERT INTO registration_scans (registration_id, position_index, scan_key, point_count, points_used, "
    "residual_median_um) VALUES ($1, $2, " SIXPOINT_SCAN_KEY("$3") ", $4, $5, $6)";
constexpr char kInsertAgreement[] =
    "INSERT INTO registration_agreements (registration_id, position_index, scan_key, other_scan_key, patch_count, "
    "difference_rms_um, expected_rms_um) VALUES ($1, $2, " SIXPOINT_SCAN_KEY("$3") ", " SIXPOINT_SCAN_KEY(
        "$4") ", $5, $6, $7)";
constexpr char kInsertRegistrationDatum[] =
    "INSERT INTO registration_datums (registration_id, position_index, datum_name, distance_um, "
    "standard_uncertainty_um, point_count) VALUES ($1, $2, $3, $4, $5, $6)";
constexpr char kInsertAngle[] =
    "INSERT INTO registration_angles (registration_id, position_index, axis, characterisation_id, commanded_deg, "
    "reached_deg, standard_uncertainty_deg, half_reversal_deg, pose_per_rad) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9)";
constexpr char kInsertErrorSource[] =
    "INSERT INTO registration_error_sources (registration_id, position_index, source_name, degrees_of_freedom, "
    "draw_count, parameters_per_sigma, pose_per_sigma) VALUES ($1, $2, $3, $4, $5, $6, $7)";
constexpr char kSelectErrorSources[] =
    "SELECT registration_id, source_name, degrees_of_freedom, draw_count, parameters_per_sigma, pose_per_sigma "
    "FROM registration_error_sources WHERE registration_id = ANY ($1::uuid[]) ORDER BY registration_id, position_index";
constexpr char kSelectRegistrationScans[] =
    "SELECT registration_id, " SIXPOINT_SCAN_ID("scan_key")
    ", point_count, points_used, residual_median_um FROM registration_scans "
    "WHERE registration_id = ANY ($1::uuid[]) ORDER BY registration_id, position_index";
constexpr char kSelectRegistrationDatums[] =
    "SELECT registration_id, datum_name, distance_um, standard_uncertainty_um, point_count FROM registration_datums "
    "WHERE registration_id = ANY ($1::uuid[]) ORDER BY registration_id, position_index";
constexpr char kSelectAgreements[] =
    "SELECT registration_id, " SIXPOINT_SCAN_ID("scan_key") ", " SIXPOINT_SCAN_ID("other_scan_key")
    ", patch_count, difference_rms_um, expected_rms_um "
    "FROM registration_agreements WHERE registration_id = ANY ($1::uuid[]) ORDER BY registration_id, position_index";
constexpr char kSelectAngles[] =
    "SELECT registration_id, axis, characterisation_id, commanded_deg, reached_deg, standard_uncertainty_deg, "
    "half_reversal_deg, pose_per_rad FROM registration_angles WHERE registration_id = ANY ($1::uuid[]) "
    "ORDER BY registration_id, position_index";

Params RegistrationParams(const RegistrationRow& row) {
  Params params;
  params.Uuid(row.registration_id).Text(row.blade_serial).Text(row.machine_id).Int(row.machine_revision);
  params.Text(row.part_id).Int(row.part_revision).Text(row.method).Uuid(row.sensor_calibration_id);
  params.Uuid(row.rotation_calibration_id).Text(row.outcome).Reals(row.zero_from_part).Reals(row.reference_mm);
  params.Reals(row.covariance).Reals(row.noise_covariance).Reals(row.calibration_sensitivity).Int(row.point_count);
  params.Int(row.points_used).Int(row.iteration_count).OptionalReal(row.residual_rms_um);
  params.OptionalReal(row.residual_sigma_um).OptionalReal(row.condition_number);
  row.weakest_direction.empty() ? params.Null() : params.Reals(row.weakest_direction);
  params.OptionalReal(row.weakest_standard_uncertainty_um);
  params.Text(row.remark).Real(row.compute_seconds).Text(row.requested_by).Text(row.software_version);
  params.Text(row.weakest_direction_in_words);
  for (const std::optional<double>& figure :
       {row.noise_sigma_um, row.model_sigma_um, row.information_kept, row.surface_part, row.least_stock_mm,
        row.lacking_mm, row.disagreement_um, row.disagreement_ratio})
    params.OptionalReal(figure);
  row.disagrees.has_value() ? params.Bool(*row.disagrees) : params.Null();
  params.Bool(row.for_inspection);
  params.OptionalText(row.clamping).OptionalReal(row.thermal_stretch);
  row.sensor_calibration_asked ? params.Bool(true) : params.Null();
  params.OptionalTime(row.scans_received_at);
  params.OptionalText(row.computed_on).OptionalText(row.station);
  params.Json(row.options_json).Json(row.detail_json);
  return params;
}

RegistrationRow ReadRegistration(const Rows& rows, int row) {
  RegistrationRow read;
  int column = 0;
  read.registration_id = rows.Text(row, column++);
  read.blade_serial = rows.Text(row, column++);
  read.machine_id = rows.Text(row, column++);
  read.machine_revision = static_cast<int>(rows.Int(row, column++));
  read.part_id = rows.Text(row, column++);
  read.part_revision = static_cast<int>(rows.Int(row, column++));
  read.method = rows.Text(row, column++);
  read.sensor_calibration_id = rows.Text(row, column++);
  read.rotation_calibration_id = rows.Text(row, column++);
  read.outcome = rows.Text(row, column++);
  read.zero_from_part = rows.Reals(row, column++);
  read.reference_mm = rows.Reals(row, column++);
  read.covariance = rows.Reals(row, column++);
  read.noise_covariance = rows.Reals(row, column++);
  read.calibration_sensitivity = rows.Reals(row, column++);
  read.point_count = rows.Int(row, column++);
  read.points_used = rows.Int(row, column++);
  read.iteration_count = static_cast<int>(rows.Int(row, column++));
  read.residual_rms_um = rows.OptionalReal(row, column++);
  read.residual_sigma_um = rows.OptionalReal(row, column++);
  read.condition_number = rows.OptionalReal(row, column++);
  if (!rows.IsNull(row, column)) read.weakest_direction = rows.Reals(row, column);
  ++column;
  read.weakest_standard_uncertainty_um = rows.OptionalReal(row, column++);
  read.remark = rows.Text(row, column++);
  read.compute_seconds = rows.Real(row, column++);
  ++column;  // requested_by: whose it is stands last
  read.software_version = rows.Text(row, column++);
  read.weakest_direction_in_words = rows.Text(row, column++);
  for (std::optional<double>* figure :
       {&read.noise_sigma_um, &read.model_sigma_um, &read.information_kept, &read.surface_part, &read.least_stock_mm,
        &read.lacking_mm, &read.disagreement_um, &read.disagreement_ratio})
    *figure = rows.OptionalReal(row, column++);
  if (!rows.IsNull(row, column)) read.disagrees = rows.Bool(row, column);
  ++column;
  read.for_inspection = rows.Bool(row, column++);
  read.clamping = rows.OptionalText(row, column++);
  read.thermal_stretch = rows.OptionalReal(row, column++);
  read.sensor_calibration_asked = !rows.IsNull(row, column++);
  if (!rows.IsNull(row, column)) read.scans_received_at = rows.Time(row, column);
  ++column;
  read.computed_on = rows.OptionalText(row, column++);
  read.station = rows.OptionalText(row, column++);
  read.options_json = rows.Text(row, column++);
  read.detail_json = rows.Text(row, column++);
  read.recorded = {rows.Int(row, column), rows.Time(row, column + 1)};
  read.requested_by = rows.Text(row, column + 2);
  return read;
}

// Scans, agreements, datums, error sources and angles of all the rows at once: five statements for a page.
absl::Status ReadChildren(Transaction& transaction, std::vector<RegistrationRow>* registrations) {
  const ParentRows<RegistrationRow> parents(registrations, &RegistrationRow::registration_id);
  if (parents.ids().empty()) return absl::OkStatus();
  const Params ids = Params().Uuids(parents.ids());
  absl::Status read = parents.Add(transaction.Execute(kSelectRegistrationScans, ids), [](RegistrationRow& registration,
                                                                                         const Rows& rows, int row) {
    registration.scans.push_back({rows.Text(row, 1), rows.Int(row, 2), rows.Int(row, 3), rows.OptionalReal(row, 4)});
  });
  if (!read.ok()) return read;
  read = parents.Add(
      transaction.Execute(kSelectAgreements, ids), [](RegistrationRow& registration, const Rows& rows, int row) {
        registration.agreements.push_back(
            {rows.Text(row, 1), rows.Text(row, 2), rows.Int(row, 3), rows.Real(row, 4), rows.Real(row, 5)});
      });
  if (!read.ok()) return read;
  read = parents.Add(transaction.Execute(kSelectRegistrationDatums, ids), [](RegistrationRow& registration,
                                                                             const Rows& rows, int row) {
    registration.datums.push_back({rows.Text(row, 1), rows.Real(row, 2), rows.Real(row, 3), rows.Int(row, 4)});
  });
  if (!read.ok()) return read;
  read = parents.Add(transaction.Execute(kSelectErrorSources, ids),
                     [](RegistrationRow& registration, const Rows& rows, int row) {
                       RegistrationErrorSourceRow& source = registration.error_sources.emplace_back();
                       source.source_name = rows.Text(row, 1);
                       source.degrees_of_freedom = rows.OptionalReal(row, 2);
                       source.draw_count = static_cast<int>(rows.Int(row, 3));
                       source.parameters_per_sigma = rows.Reals(row, 4);
                       source.pose_per_sigma = rows.Reals(row, 5);
                     });
  if (!read.ok()) return read;
  return parents.Add(
      transaction.Execute(kSelectAngles, ids), [](RegistrationRow& registration, const Rows& rows, int row) {
        registration.angles.push_back({rows.Text(row, 1), rows.OptionalText(row, 2), rows.Real(row, 3),
                                       rows.Real(row, 4), rows.Real(row, 5), rows.Real(row, 6), rows.Reals(row, 7)});
      });
}

absl::StatusOr<std::vector<RegistrationRow>> ReadRegistrations(Transaction& transaction, const char* sql,
                                                               const Params& params) {
  auto registrations = AllRows(transaction, sql, params, ReadRegistration);
  if (!registrations.ok()) return registrations;
  if (absl::Status status = ReadChildren(transaction, &*registrations); !status.ok()) return status;
  return registrations;
}

}  // namespace

std::shared_ptr<RegistrationStore> RegistrationsIn(Database* database) {
  using Store = PostgresResults<RegistrationRow, RegistrationFilter>;
  return std::make_shared<Store>(database, Store::Statements{InsertRegistration, FindRegistration, ListRegistrations});
}

absl::StatusOr<Recorded> InsertRegistration(Transaction& transaction, const RegistrationRow& registration,
                                            const RecordEntry& entry) {
  const auto stored = transaction.Execute(kInsertRegistration, RegistrationParams(registration));
  if (!stored.ok()) return stored.status();
  int position = 0;
  for (const RegistrationScanRow& scan : registration.scans) {
    Params params;
    params.Uuid(registration.registration_id).Int(position++).Text(scan.scan_id).Int(scan.point_count);
    params.Int(scan.points_used).OptionalReal(scan.residual_median_um);
    if (const auto inserted = transaction.Execute(kInsertRegistrationScan, params); !inserted.ok())
      return inserted.status();
  }
  position = 0;
  for (const RegistrationAgreementRow& agreement : registration.agreements) {
    Params params;
    params.Uuid(registration.registration_id).Int(position++).Text(agreement.scan_id).Text(agreement.other_scan_id);
    params.Int(agreement.patch_count).Real(agreement.difference_rms_um).Real(agreement.expected_rms_um);
    if (const auto inserted = transaction.Execute(kInsertAgreement, params); !inserted.ok()) return inserted.status();
  }
  position = 0;
  for (const RegistrationDatumRow& datum : registration.datums) {
    Params params;
    params.Uuid(registration.registration_id).Int(position++).Text(datum.datum_name).Real(datum.distance_um);
    params.Real(datum.standard_uncertainty_um).Int(datum.point_count);
    if (const auto inserted = transaction.Execute(kInsertRegistrationDatum, params); !inserted.ok())
      return inserted.status();
  }
  position = 0;
  for (const RegistrationAngleRow& angle : registration.angles) {
    Params params;
    params.Uuid(registration.registration_id).Int(position++).Text(angle.axis).OptionalUuid(angle.characterisation_id);
    params.Real(angle.commanded_deg).Real(angle.reached_deg).Real(angle.standard_uncertainty_deg);
    params.Real(angle.half_reversal_deg).Reals(angle.pose_per_rad);
    if (const auto inserted = transaction.Execute(kInsertAngle, params); !inserted.ok()) return inserted.status();
  }
  position = 0;
  for (const RegistrationErrorSourceRow& source : registration.error_sources) {
    Params params;
    params.Uuid(registration.registration_id).Int(position++).Text(source.source_name);
    params.OptionalReal(source.degrees_of_freedom)
        .Int(source.draw_count)
        .Reals(source.parameters_per_sigma)
        .Reals(source.pose_per_sigma);
    if (const auto inserted = transaction.Execute(kInsertErrorSource, params); !inserted.ok()) return inserted.status();
  }
  return AppendRecord(transaction, registration.registration_id, entry);
}

absl::StatusOr<std::optional<RegistrationRow>> FindRegistration(Transaction& transaction,
                                                                const std::string& registration_id) {
  return FirstOf(ReadRegistrations(transaction, kSelectRegistration, Params().Uuid(registration_id)));
}

absl::StatusOr<std::vector<RegistrationRow>> ListRegistrations(Transaction& transaction,
                                                               const RegistrationFilter& filter,
                                                               std::int64_t before_sequence, int limit) {
  absl::StatusOr<Params> params = FilterParams(transaction, before_sequence, filter);
  if (!params.ok()) return params.status();
  params->Text(filter.outcome).Bool(filter.only_disagreeing).Bool(filter.without_for_inspection).Int(limit);
  return ReadRegistrations(transaction, kListRegistrations, *params);
}

}  // namespace sixpoint::storage
