#include "services/ingest/scan_messages.h"

#include <absl/strings/ascii.h>
#include <google/protobuf/util/message_differencer.h>

#include <tuple>
#include <utility>

#include "services/runtime/contract_words.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::ingest {
namespace {

// The record's words of these are in small letters.
template <typename Enum>
std::string SmallWordOf(Enum value) {
  return absl::AsciiStrToLower(runtime::WordOf(value));
}

}  // namespace

std::string KindText(v1::ScanKind kind) { return SmallWordOf(kind); }

absl::StatusOr<storage::ScanFilter> FilterOf(const v1::ListScansRequest& request) {
  storage::ScanFilter filter;
  for (const auto& [field, collection, name, id] :
       {std::tuple("machine", "machines", &request.machine(), &filter.machine_id),
        std::tuple("part", "parts", &request.part(), &filter.part_id)}) {
    absl::StatusOr<std::string> read = runtime::FilterIdOf(field, collection, *name);
    if (!read.ok()) return read.status();
    *id = *std::move(read);
  }
  const bool of_artefact = request.subject().rfind("artefacts/", 0) == 0;
  absl::StatusOr<std::string> subject =
      runtime::FilterIdOf("subject", of_artefact ? "artefacts" : "blades", request.subject());
  if (!subject.ok()) return subject.status();
  (of_artefact ? filter.artefact_id : filter.blade_serial) = *std::move(subject);
  filter.kind = KindText(request.kind());
  if (filter.kind.empty() && request.kind() != v1::SCAN_KIND_UNSPECIFIED)
    return runtime::Refuse("kind", std::to_string(request.kind()), "a known kind or none");
  const absl::StatusOr<storage::TimeSpan> recorded = runtime::SpanOf("recorded", request.recorded());
  if (!recorded.ok()) return recorded.status();
  filter.recorded = *recorded;
  return filter;
}

v1::StoredBlock ToProto(int index, const storage::ScanBlockRow& row) {
  v1::StoredBlock block;
  block.set_index(index);
  block.set_point_count(row.point_count);
  block.set_first_profile(row.first_profile);
  block.set_profile_count(row.profile_count);
  block.set_sha256(row.blob_sha256);
  block.set_sent_sha256(row.evidence_sha256);
  return block;
}

absl::StatusOr<v1::Scan> ToProto(const storage::ScanRow& row) {
  runtime::StoredWords words("scan " + row.scan_id);
  v1::Scan scan;
  scan.set_name(runtime::NameOf("scans", row.scan_id));
  v1::ScanHeader& header = *scan.mutable_header();
  header.set_scan_id(row.scan_id);
  header.set_machine(runtime::NameOf("machines", row.machine_id));
  header.set_subject(row.artefact_id ? runtime::NameOf("artefacts", *row.artefact_id)
                                     : runtime::NameOf("blades", row.blade_serial.value_or("")));
  header.set_kind(words.Value<v1::ScanKind>(row.kind));
  runtime::SetPoint(row.v0_mm, header.mutable_v0_mm());
  header.set_a_deg(row.a_deg);
  header.set_b_deg(row.b_deg);
  header.set_profile_pitch_mm(row.profile_pitch_mm);
  header.set_columns_per_profile(row.columns_per_profile);
  header.set_point_count(row.point_count);
  header.set_encoding(words.Value<v1::Encoding>(row.encoding));
  header.set_raw_step_um(row.raw_step_um);
  header.set_arm_series(row.arm_series);
  header.set_clamping(row.clamping);
  header.set_station(row.station);
  if (row.subject_temperature_c) header.set_subject_temperature_c(*row.subject_temperature_c);
  if (row.scales_temperature_c) header.set_scales_temperature_c(*row.scales_temperature_c);
  header.set_sensor_serial_number(row.sensor_serial_number);
  header.set_travel(words.ValueOrNone<v1::ScanTravel>(row.travel));
  header.set_cloud(words.ValueOrNone<v1::CloudKind>(row.cloud));
  header.set_length_unit(words.ValueOrNone<v1::LengthUnit>(row.length_unit));
  header.set_sender_error_um(row.sender_error_um);
  header.set_error_bound_um(row.error_bound_um);
  if (row.measured_at) runtime::ToProto(*row.measured_at, header.mutable_measured_at());
  scan.set_block_count(row.block_count);
  scan.set_sha256(row.stored_sha256);
  scan.set_stored_bytes(row.stored_bytes);
  scan.set_proven_error_um(row.proven_error_um);
  runtime::ToProto(row.recorded.recorded_at, scan.mutable_received_at());
  scan.set_record_sequence(row.recorded.sequence);
  scan.set_stored_encoding(words.Value<v1::Encoding>(row.stored_encoding));
  scan.set_profile_count(row.profile_count);
  scan.set_sent_sha256(row.sent_sha256);
  return words.Checked(std::move(scan));
}

storage::ScanRow RowOf(const v1::ScanHeader& header, int machine_revision, int artefact_revision) {
  storage::ScanRow row;
  row.scan_id = header.scan_id();
  row.machine_id = runtime::LastSegment(header.machine());
  row.machine_revision = machine_revision;
  if (header.subject().rfind("artefacts/", 0) == 0) {
    row.artefact_id = runtime::LastSegment(header.subject());
    row.artefact_revision = artefact_revision;
  } else {
    row.blade_serial = runtime::LastSegment(header.subject());
  }
  row.kind = KindText(header.kind());
  row.v0_mm = {header.v0_mm().x_mm(), header.v0_mm().y_mm(), header.v0_mm().z_mm()};
  row.a_deg = header.a_deg();
  row.b_deg = header.b_deg();
  row.profile_pitch_mm = header.profile_pitch_mm();
  row.columns_per_profile = header.columns_per_profile();
  row.point_count = header.point_count();
  row.encoding = SmallWordOf(header.encoding());
  row.raw_step_um = header.raw_step_um();
  row.arm_series = header.arm_series();
  row.clamping = header.clamping();
  row.station = header.station();
  if (header.has_subject_temperature_c()) row.subject_temperature_c = header.subject_temperature_c();
  if (header.has_scales_temperature_c()) row.scales_temperature_c = header.scales_temperature_c();
  row.sensor_serial_number = header.sensor_serial_number();
  row.travel = runtime::WordOf(header.travel());
  row.cloud = runtime::WordOf(header.cloud());
  row.length_unit = runtime::WordOf(header.length_unit());
  // There is no range image of a snapshot.
  const bool as_draco = header.encoding() == v1::ENCODING_DRACO || header.cloud() == v1::CLOUD_KIND_SNAPSHOT;
  row.stored_encoding = SmallWordOf(as_draco ? v1::ENCODING_DRACO : v1::ENCODING_RANGE_IMAGE);
  row.sender_error_um = header.sender_error_um();
  row.error_bound_um = header.error_bound_um();
  if (header.has_measured_at()) row.measured_at = runtime::MomentOf(header.measured_at());
  return row;
}

void RoundAsStored(v1::ScanHeader* header) {
  if (header->has_measured_at())
    runtime::ToProto(runtime::MomentOf(header->measured_at()), header->mutable_measured_at());
}

std::string DifferencesOf(const v1::ScanHeader& stored, const v1::ScanHeader& sent) {
  v1::ScanHeader known = stored;
  if (sent.point_count() == 0) known.set_point_count(0);  // the end tells
  google::protobuf::util::MessageDifferencer differencer;
  std::string report;
  differencer.ReportDifferencesToString(&report);
  if (differencer.Compare(known, sent)) return "";
  while (!report.empty() && report.back() == '\n') report.pop_back();
  for (std::size_t end = report.find('\n'); end != std::string::npos; end = report.find('\n', end)) {
    report.replace(end, 1, "; ");
  }
  return report;
}

}  // namespace sixpoint::ingest
