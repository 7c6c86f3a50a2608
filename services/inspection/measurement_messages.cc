#include "services/inspection/measurement_messages.h"

#include <string>

#include "services/inspection/order_checks.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/time_proto.h"
#include "storage/blobs.h"

namespace sixpoint::inspection {
namespace {

// The enum's name without its prefix; empty of what is no value, and of UNSPECIFIED.
template <typename Enum>
std::string WordOf(Enum value, const std::string& (*name)(Enum), const std::string& prefix) {
  const std::string& whole = name(value);
  return static_cast<int>(value) == 0 || whole.size() <= prefix.size() ? "" : whole.substr(prefix.size());
}

const std::string& KindName(v1::InstrumentKind kind) { return v1::InstrumentKind_Name(kind); }
const std::string& FormatName(v1::MeasurementFormat format) { return v1::MeasurementFormat_Name(format); }
const std::string& ZoneName(plant::v1::ToleranceZone zone) { return plant::v1::ToleranceZone_Name(zone); }

absl::Status CheckSaid(const std::string& field, const std::string& text) {
  std::set<std::string> none;
  return CheckCalled(field, text, &none);
}

absl::StatusOr<storage::InstrumentRow> InstrumentOf(const v1::Instrument& in) {
  storage::InstrumentRow instrument;
  runtime::Refusals refusals;
  instrument.kind = WordOf(in.kind(), KindName, "INSTRUMENT_KIND_");
  if (instrument.kind.empty())
    refusals.Add(runtime::Refuse("instrument.kind", static_cast<double>(in.kind()),
                                 "CMM, OPTICAL, CT, GAUGE, FLOW_BENCH or OTHER"));
  refusals.Add(CheckSaid("instrument.manufacturer", in.manufacturer()));
  refusals.Add(CheckSaid("instrument.model", in.model()));
  refusals.Add(CheckSaid("instrument.serial_number", in.serial_number()));
  if (!in.certificate().empty()) refusals.Add(CheckSaid("instrument.certificate", in.certificate()));
  if (!refusals.status().ok()) return refusals.status();
  instrument.manufacturer = in.manufacturer();
  instrument.model = in.model();
  instrument.serial_number = in.serial_number();
  instrument.certificate = in.certificate();
  return instrument;
}

absl::Status ReadUncertainty(const v1::StatedUncertainty& in, ImportOrder* order) {
  runtime::Refusals refusals;
  const auto read = [&](const char* field, bool stated, double value, double greatest, std::optional<double>* to) {
    if (!stated) return;
    if (!(value > 0 && value <= greatest))
      refusals.Add(runtime::Refuse(field, value, "more than 0, at most " + std::to_string(static_cast<int>(greatest))));
    *to = value;
  };
  read("uncertainty.lengths_um", in.has_lengths_um(), in.lengths_um(), 1000,
       &order->statement.lengths_expanded_uncertainty_um);
  read("uncertainty.angles_deg", in.has_angles_deg(), in.angles_deg(), 10,
       &order->statement.angles_expanded_uncertainty_deg);
  if (!in.has_lengths_um() && !in.has_angles_deg())
    refusals.Add(
        runtime::Refuse("uncertainty", "nothing stated", "lengths_um or angles_deg, or no uncertainty at all"));
  refusals.Add(CheckSaid("uncertainty.basis", in.basis()));
  order->file.lengths_expanded_uncertainty_um = order->statement.lengths_expanded_uncertainty_um;
  order->file.angles_expanded_uncertainty_deg = order->statement.angles_expanded_uncertainty_deg;
  order->file.uncertainty_basis = in.basis();
  return refusals.status();
}

absl::Status ReadZone(const char* field, plant::v1::ToleranceZone in, const std::set<std::string>& known,
                      const char* wanted, std::string* zone) {
  *zone = WordOf(in, ZoneName, "TOLERANCE_ZONE_");
  if (in == plant::v1::TOLERANCE_ZONE_UNSPECIFIED || known.count(*zone) > 0) return absl::OkStatus();
  return runtime::Refuse(field, static_cast<double>(in), wanted);
}

absl::StatusOr<exchange::MeasuredFormat> FormatOf(v1::MeasurementFormat format) {
  switch (format) {
    case v1::MEASUREMENT_FORMAT_QIF:
      return exchange::MeasuredFormat::kQif;
    case v1::MEASUREMENT_FORMAT_AQDEF:
      return exchange::MeasuredFormat::kAqdef;
    case v1::MEASUREMENT_FORMAT_CSV:
      return exchange::MeasuredFormat::kCsv;
    default:
      return runtime::Refuse("format", static_cast<double>(format), "QIF, AQDEF or CSV");
  }
}

absl::Status Fill(const storage::MeasuredValueRow& row, const std::string& what, v1::MeasuredCharacteristic* out) {
  const auto unit = runtime::StoredEnum<plant::v1::CharacteristicUnit>(row.unit, what);
  if (!unit.ok()) return unit.status();
  out->set_characteristic(row.characteristic);
  out->set_feature(row.feature);
  out->set_unit(*unit);
  if (!row.zone.empty()) {
    const auto zone = runtime::StoredEnum<plant::v1::ToleranceZone>(row.zone, what);
    if (!zone.ok()) return zone.status();
    out->set_zone(*zone);
  }
  if (row.value) out->set_value(*row.value);
  if (row.expanded_uncertainty) out->set_expanded_uncertainty(*row.expanded_uncertainty);
  out->set_reason(row.reason);
  return absl::OkStatus();
}

void SetUncertainty(const storage::MeasuredFileRow& file, v1::Measurement* out) {
  if (file.uncertainty_basis.empty()) return;
  v1::StatedUncertainty& stated = *out->mutable_uncertainty();
  if (file.lengths_expanded_uncertainty_um) stated.set_lengths_um(*file.lengths_expanded_uncertainty_um);
  if (file.angles_expanded_uncertainty_deg) stated.set_angles_deg(*file.angles_expanded_uncertainty_deg);
  stated.set_basis(file.uncertainty_basis);
}

}  // namespace

absl::StatusOr<v1::Measurement> ToProto(const storage::MeasurementRow& row) {
  v1::Measurement measurement;
  const storage::MeasuredFileRow& file = row.file;
  const std::string what = "measurement " + row.measurement_id;
  measurement.set_name(runtime::NameOf("measurements", row.measurement_id));
  measurement.set_blade(runtime::NameOf("blades", row.blade_serial));
  measurement.set_drawing(runtime::RevisedName("drawings", file.drawing_id, file.drawing_revision));
  measurement.set_part(runtime::NameOf("parts", file.part_id));
  const auto kind = runtime::StoredEnum<v1::InstrumentKind>(file.instrument.kind, what);
  if (!kind.ok()) return kind.status();
  const auto format = runtime::StoredEnum<v1::MeasurementFormat>(file.format, what);
  if (!format.ok()) return format.status();
  v1::Instrument& instrument = *measurement.mutable_instrument();
  instrument.set_kind(*kind);
  instrument.set_manufacturer(file.instrument.manufacturer);
  instrument.set_model(file.instrument.model);
  instrument.set_serial_number(file.instrument.serial_number);
  instrument.set_certificate(file.instrument.certificate);
  runtime::ToProto(row.measured_at, measurement.mutable_measured_at());
  measurement.set_format(*format);
  measurement.set_file_sha256(file.sha256);
  SetUncertainty(file, &measurement);
  for (const storage::MeasuredValueRow& value : row.values)
    if (absl::Status status = Fill(value, what, measurement.add_values()); !status.ok()) return status;
  measurement.set_value_count(row.value_count);
  measurement.set_measured_count(row.measured_count);
  for (const std::string& name : row.left_out) measurement.add_left_out(name);
  measurement.set_left_out_count(row.left_out_count);
  measurement.set_requested_by(file.requested_by);
  measurement.set_software_version(file.software_version);
  runtime::ToProto(row.recorded.recorded_at, measurement.mutable_recorded_at());
  measurement.set_record_sequence(row.recorded.sequence);
  measurement.set_work_order(row.work_order);
  measurement.set_operation(row.operation);
  return measurement;
}

absl::StatusOr<v1::ImportMeasurementsResponse> ToProto(const storage::MeasurementImport& import) {
  v1::ImportMeasurementsResponse response;
  for (const storage::MeasurementRow& row : import.measurements) {
    auto measurement = ToProto(row);
    if (!measurement.ok()) return measurement.status();
    measurement->clear_values();
    *response.add_measurements() = *std::move(measurement);
  }
  return response;
}

void LeaveBasic(v1::Measurement* measurement) {
  measurement->clear_values();
  measurement->clear_left_out();
}

absl::StatusOr<ImportOrder> OrderOf(const v1::ImportMeasurementsRequest& request) {
  ImportOrder order;
  runtime::Refusals refusals;
  refusals.Add(runtime::RevisedIdOf("drawing", "drawings", request.drawing()).status());
  const auto serial = runtime::FilterIdOf("blade", "blades", request.blade());
  refusals.Add(serial.status());
  if (serial.ok()) order.statement.serial = *serial;
  if (request.content().empty()) refusals.Add(runtime::Refuse("content", "", "the file"));
  const auto format = FormatOf(request.format());
  refusals.Add(format.status());
  if (format.ok()) order.format = *format;
  const auto instrument = InstrumentOf(request.instrument());
  refusals.Add(instrument.status());
  if (instrument.ok()) order.file.instrument = *instrument;
  if (request.has_uncertainty()) refusals.Add(ReadUncertainty(request.uncertainty(), &order));
  if (request.has_measured_at()) {
    refusals.Add(runtime::CheckPast("measured_at", request.measured_at()));
    order.statement.measured_at = runtime::MomentOf(request.measured_at());
  }
  refusals.Add(ReadZone("position_zone", request.position_zone(), {"DIAMETER", "RADIUS"}, "DIAMETER or RADIUS",
                        &order.statement.position_zone));
  refusals.Add(ReadZone("profile_zone", request.profile_zone(), {"WIDTH", "HALF_WIDTH", "BORDERS"},
                        "WIDTH, HALF_WIDTH or BORDERS", &order.statement.profile_zone));
  if (!refusals.status().ok()) return refusals.status();
  order.statement.only_drawn = request.only_drawn();
  order.file.format = WordOf(request.format(), FormatName, "MEASUREMENT_FORMAT_");
  order.file.sha256 = storage::Sha256Hex(request.content());
  order.file.software_version = runtime::SoftwareVersion();
  return order;
}

}  // namespace sixpoint::inspection
