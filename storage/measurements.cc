#include "storage/measurements.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "storage/children.h"
#include "storage/clearances.h"
#include "storage/each_row.h"
#include "storage/one_read.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_MEASUREMENT_COLUMNS                                                                           \
  "measurement_id, blade_serial, drawing_id, drawing_revision, part_id, instrument_kind, "                     \
  "instrument_manufacturer, instrument_model, instrument_serial_number, instrument_certificate, measured_at, " \
  "file_format, file_sha256, lengths_expanded_uncertainty_um, angles_expanded_uncertainty_deg, "               \
  "uncertainty_basis, left_out, left_out_count, requested_by, software_version"
constexpr char kInsertMeasurement[] =
    "INSERT INTO measurements (" SIXPOINT_MEASUREMENT_COLUMNS
    ", import_id, import_index, value_count, measured_count) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, "
    "$12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, $23, $24)";
#define SIXPOINT_SELECT_MEASUREMENTS                                                                   \
  "SELECT " SIXPOINT_MEASUREMENT_COLUMNS                                                               \
  ", record_sequence, recorded_at, name_of(requested_by), entry_order, entry_operation, value_count, " \
  "measured_count FROM measurements m"                                                                 \
  " JOIN recorded r ON r.record_id = m.measurement_id WHERE "
constexpr char kSelectMeasurement[] = SIXPOINT_SELECT_MEASUREMENTS "measurement_id = $1";
constexpr char kSelectImport[] = SIXPOINT_SELECT_MEASUREMENTS
    "import_id = (SELECT i.import_id FROM measurements i WHERE i.measurement_id = $1) ORDER BY import_index";
// Where blades are named ($10) their rows are found and then sorted, as SIXPOINT_NEWEST_FIRST has it.
constexpr char kListMeasurements[] = SIXPOINT_SELECT_MEASUREMENTS
    "entry_kind = 'measurement' AND ($1::bigint = 0 OR record_sequence < $1::bigint) AND ($2 = '' OR entry_blade = $2) "
    "AND ($3 = '' OR part_id = $3) AND ($4 = '' OR drawing_id = $4) AND ($5 = '' OR instrument_serial_number = $5) AND "
    "($6::bytea IS NULL OR file_sha256 = $6::bytea) AND ($7::timestamptz IS NULL OR recorded_at >= $7) AND "
    "($8::timestamptz IS NULL OR recorded_at < $8) AND part_id <> ALL ($9::text[]) AND ($10::text[] IS NULL OR "
    "entry_blade = ANY ($10::text[])) ORDER BY (CASE WHEN $10::text[] IS NULL THEN record_sequence ELSE "
    "record_sequence + 0 END) DESC LIMIT $11";
#undef SIXPOINT_SELECT_MEASUREMENTS
#undef SIXPOINT_MEASUREMENT_COLUMNS
constexpr char kInsertMeasuredValues[] =
    "INSERT INTO measurement_values (measurement_id, position_index, characteristic, feature, unit, zone, value, "
    "expanded_uncertainty, reason) SELECT $1::uuid, (position - 1)::integer, characteristic, feature, unit, "
    "NULLIF(zone, ''), value, expanded, reason FROM unnest($2::text[], $3::text[], $4::text[], $5::text[], "
    "$6::double precision[], $7::double precision[], $8::text[]) WITH ORDINALITY AS one (characteristic, feature, "
    "unit, zone, value, expanded, reason, position)";
constexpr char kSelectMeasuredValues[] =
    "SELECT measurement_id, characteristic, feature, unit, zone, value, expanded_uncertainty, reason FROM "
    "measurement_values WHERE measurement_id = ANY ($1::uuid[]) ORDER BY measurement_id, position_index";

Params MeasurementParams(const MeasurementImport& import, std::size_t index) {
  const MeasurementRow& row = import.measurements[index];
  const MeasuredFileRow& file = row.file;
  Params params;
  params.Uuid(row.measurement_id).Text(row.blade_serial).Text(file.drawing_id).Int(file.drawing_revision);
  params.Text(file.part_id).Text(file.instrument.kind).Text(file.instrument.manufacturer);
  params.Text(file.instrument.model).Text(file.instrument.serial_number).OptionalText(file.instrument.certificate);
  params.Time(row.measured_at).Text(file.format).Digest(file.sha256);
  params.OptionalReal(file.lengths_expanded_uncertainty_um).OptionalReal(file.angles_expanded_uncertainty_deg);
  params.OptionalText(file.uncertainty_basis).Texts(row.left_out).Int(row.left_out_count);
  params.Text(import.requested_by).Text(file.software_version).Uuid(import.measurements.front().measurement_id);
  params.Int(static_cast<std::int64_t>(index)).Int(row.value_count);
  return params.Int(row.measured_count);
}

Params MeasuredValuesParams(const MeasurementRow& row) {
  std::vector<std::string> characteristics, features, units, zones, reasons;
  std::vector<std::optional<double>> values, expanded;
  for (const MeasuredValueRow& value : row.values) {
    characteristics.push_back(value.characteristic);
    features.push_back(value.feature);
    units.push_back(value.unit);
    zones.push_back(value.zone);
    values.push_back(value.value);
    expanded.push_back(value.expanded_uncertainty);
    reasons.push_back(value.reason);
  }
  Params params;
  params.Uuid(row.measurement_id).Texts(characteristics).Texts(features).Texts(units).Texts(zones);
  return params.OptionalReals(values).OptionalReals(expanded).Texts(reasons);
}

MeasurementRow ReadMeasurement(const Rows& rows, int row) {
  MeasurementRow measurement;
  MeasuredFileRow& file = measurement.file;
  measurement.measurement_id = rows.Text(row, 0);
  measurement.blade_serial = rows.Text(row, 1);
  file.drawing_id = rows.Text(row, 2);
  file.drawing_revision = static_cast<int>(rows.Int(row, 3));
  file.part_id = rows.Text(row, 4);
  file.instrument = {rows.Text(row, 5), rows.Text(row, 6), rows.Text(row, 7), rows.Text(row, 8),
                     rows.OptionalText(row, 9)};
  measurement.measured_at = rows.Time(row, 10);
  file.format = rows.Text(row, 11);
  file.sha256 = rows.Digest(row, 12);
  file.lengths_expanded_uncertainty_um = rows.OptionalReal(row, 13);
  file.angles_expanded_uncertainty_deg = rows.OptionalReal(row, 14);
  file.uncertainty_basis = rows.OptionalText(row, 15);
  measurement.left_out = rows.Texts(row, 16);
  measurement.left_out_count = static_cast<int>(rows.Int(row, 17));
  file.software_version = rows.Text(row, 19);
  measurement.recorded = {rows.Int(row, 20), rows.Time(row, 21)};
  file.requested_by = rows.Text(row, 22);
  measurement.work_order = rows.OptionalText(row, 23);
  measurement.operation = rows.OptionalText(row, 24);
  measurement.value_count = static_cast<int>(rows.Int(row, 25));
  measurement.measured_count = static_cast<int>(rows.Int(row, 26));
  return measurement;
}

MeasuredValueRow ReadMeasuredValue(const Rows& rows, int row) {
  MeasuredValueRow value;
  value.characteristic = rows.Text(row, 1);
  value.feature = rows.Text(row, 2);
  value.unit = rows.Text(row, 3);
  value.zone = rows.OptionalText(row, 4);
  value.value = rows.OptionalReal(row, 5);
  value.expanded_uncertainty = rows.OptionalReal(row, 6);
  value.reason = rows.Text(row, 7);
  return value;
}

absl::StatusOr<std::vector<MeasurementRow>> ReadMeasurements(Transaction& transaction, const char* sql,
                                                             const Params& params, bool with_values = true) {
  auto measurements = AllRows(transaction, sql, params, ReadMeasurement);
  if (!measurements.ok() || measurements->empty() || !with_values) return measurements;
  const ParentRows<MeasurementRow> parents(&*measurements, &MeasurementRow::measurement_id);
  const absl::Status read = parents.Add(transaction.Execute(kSelectMeasuredValues, Params().Uuids(parents.ids())),
                                        [](MeasurementRow& measurement, const Rows& values, int row) {
                                          measurement.values.push_back(ReadMeasuredValue(values, row));
                                        });
  if (!read.ok()) return read;
  return measurements;
}

absl::StatusOr<std::optional<MeasurementRow>> FindMeasurement(Transaction& transaction, const std::string& id) {
  return FirstOf(ReadMeasurements(transaction, kSelectMeasurement, Params().Uuid(id)));
}

absl::StatusOr<std::vector<MeasurementRow>> ListMeasurements(Transaction& transaction, const MeasurementFilter& filter,
                                                             std::int64_t before_sequence, int limit) {
  const absl::StatusOr<Sight> sight = SightOf(transaction, filter.reader);
  if (!sight.ok()) return sight.status();
  Params params;
  params.Int(before_sequence).Text(filter.blade_serial).Text(filter.part_id).Text(filter.drawing_id);
  params.Text(filter.instrument_serial_number);
  filter.file_sha256.empty() ? params.Null() : params.Digest(filter.file_sha256);
  AddSpan(filter.recorded, &params);
  AddSight(*sight, &params);
  return ReadMeasurements(transaction, kListMeasurements, params.Int(limit), filter.with_values);
}

// By the name of any of its measurements.
absl::StatusOr<std::optional<MeasurementImport>> FindImport(Transaction& transaction, const std::string& name) {
  auto found = ReadMeasurements(transaction, kSelectImport, Params().Uuid(IdOfName(name).id));
  if (!found.ok()) return found.status();
  if (found->empty()) return std::nullopt;
  MeasurementImport import;
  import.requested_by = found->front().file.requested_by;
  import.recorded = found->front().recorded;
  import.measurements = *std::move(found);
  return import;
}

RecordEntry EntryOf(const MeasurementRow& row, const RecordEntry& of_file) {
  RecordEntry entry = of_file;
  entry.kind = "measurement";
  entry.name = "measurements/" + row.measurement_id;
  entry.inputs = {"blades/" + row.blade_serial,
                  "drawings/" + row.file.drawing_id + "@" + std::to_string(row.file.drawing_revision)};
  entry.blade = row.blade_serial;
  entry.method = row.file.instrument.kind;
  entry.measured_at = row.measured_at;
  const nlohmann::json summary = {{"values", row.values.size()},
                                  {"measured", row.measured_count},
                                  {"instrument", row.file.instrument.serial_number},
                                  {"file_sha256", row.file.sha256}};
  entry.summary_json = summary.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return entry;
}

class PostgresMeasurements final : public ResultReader<MeasurementRow, MeasurementFilter> {
 public:
  explicit PostgresMeasurements(Database* database) : database_(database) {}

  absl::StatusOr<std::optional<MeasurementRow>> Find(const std::string& id, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return FindMeasurement(t, id); });
  }
  absl::StatusOr<std::vector<MeasurementRow>> List(const MeasurementFilter& filter, std::int64_t before_sequence,
                                                   int limit, Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   [&](Transaction& t) { return ListMeasurements(t, filter, before_sequence, limit); });
  }

 private:
  Database* const database_;
};

class PostgresImports final : public ResultWriter<MeasurementImport> {
 public:
  explicit PostgresImports(Database* database) : database_(database) {}

  absl::StatusOr<std::optional<MeasurementImport>> FindRecorded(const RecordedRequest& request,
                                                                Deadline deadline) const override {
    return storage::FindRecorded<MeasurementImport>(*database_, request, deadline, FindImport);
  }
  absl::StatusOr<MeasurementImport> Record(const RecordedRequest& request, MeasurementImport import,
                                           const RecordEntry& entry, Deadline deadline) override {
    RecordEntry kept = entry;
    kept.request = KeptRequestOf(request);
    const auto insert = [&](Transaction& t) { return InsertMeasurements(t, import, kept); };
    return RecordOnce<MeasurementImport>(*database_, request, deadline, FindImport, insert);
  }

 private:
  Database* const database_;
};

}  // namespace

void CountValues(MeasurementRow* row) {
  row->value_count = static_cast<int>(row->values.size());
  row->measured_count = static_cast<int>(std::count_if(
      row->values.begin(), row->values.end(), [](const MeasuredValueRow& value) { return value.value.has_value(); }));
}

absl::StatusOr<MeasurementImport> InsertMeasurements(Transaction& transaction, MeasurementImport import,
                                                     const RecordEntry& entry) {
  for (std::size_t i = 0; i < import.measurements.size(); ++i) {
    absl::Status status = transaction.Execute(kInsertMeasurement, MeasurementParams(import, i)).status();
    if (status.ok())
      status = transaction.Execute(kInsertMeasuredValues, MeasuredValuesParams(import.measurements[i])).status();
    if (!status.ok()) return status;
  }
  // The journal's lock is taken from here on.
  std::optional<KeptRequest> request = entry.request;
  for (MeasurementRow& row : import.measurements) {
    RecordEntry own = EntryOf(row, entry);
    if (own.request) own.trace_id = own.request->trace_id.empty() ? own.trace_id : own.request->trace_id;
    own.request = std::exchange(request, std::nullopt);
    const absl::StatusOr<Recorded> recorded = AppendRecord(transaction, row.measurement_id, own);
    if (!recorded.ok()) return recorded.status();
    row.recorded = *recorded;
    row.file.requested_by = import.requested_by;
  }
  if (!import.measurements.empty()) import.recorded = import.measurements.front().recorded;
  return import;
}

std::shared_ptr<ResultReader<MeasurementRow, MeasurementFilter>> MeasurementsIn(Database* database) {
  return std::make_shared<PostgresMeasurements>(database);
}
std::shared_ptr<ResultWriter<MeasurementImport>> MeasurementImportsIn(Database* database) {
  return std::make_shared<PostgresImports>(database);
}

}  // namespace sixpoint::storage
