#include "services/ingest/scan_messages.h"

#include <google/protobuf/util/message_differencer.h>

#include <string_view>
#include <tuple>

#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::ingest {
namespace {

struct EncodingName {
  v1::Encoding encoding;
  const char* text;
};
constexpr EncodingName kEncodings[] = {{v1::ENCODING_DRACO, "draco"},
                                       {v1::ENCODING_XYZ_F64, "xyz_f64"},
                                       {v1::ENCODING_RAW_PROFILES, "raw_profiles"},
                                       {v1::ENCODING_RANGE_IMAGE, "range_image"}};

std::string TextOf(v1::Encoding encoding) {
  for (const EncodingName& name : kEncodings) {
    if (name.encoding == encoding) return name.text;
  }
  return "";
}

constexpr std::string_view kCloudPrefix = "CLOUD_KIND_", kUnitPrefix = "LENGTH_UNIT_";

v1::CloudKind CloudOf(const std::string& text) {
  v1::CloudKind cloud = v1::CLOUD_KIND_UNSPECIFIED;
  v1::CloudKind_Parse(std::string(kCloudPrefix) + text, &cloud);
  return cloud;
}

v1::LengthUnit UnitOf(const std::string& text) {
  v1::LengthUnit unit = v1::LENGTH_UNIT_UNSPECIFIED;
  v1::LengthUnit_Parse(std::string(kUnitPrefix) + text, &unit);
  return unit;
}

v1::Encoding EncodingOf(const std::string& text) {
  for (const EncodingName& name : kEncodings) {
    if (name.text == text) return name.encoding;
  }
  return v1::ENCODING_UNSPECIFIED;
}

}  // namespace

std::string KindText(v1::ScanKind kind) {
  switch (kind) {
    case v1::SCAN_KIND_ARTEFACT:
      return "artefact";
    case v1::SCAN_KIND_ARM:
      return "arm";
    case v1::SCAN_KIND_AIRFOIL:
      return "airfoil";
    case v1::SCAN_KIND_LOCAL:
      return "local";
    case v1::SCAN_KIND_PINS:
      return "pins";
    default:
      return "";
  }
}

v1::ScanKind KindOf(const std::string& text) {
  for (int i = 1; i < v1::ScanKind_ARRAYSIZE; ++i) {
    if (KindText(static_cast<v1::ScanKind>(i)) == text) return static_cast<v1::ScanKind>(i);
  }
  return v1::SCAN_KIND_UNSPECIFIED;
}

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

v1::Scan ToProto(const storage::ScanRow& row) {
  v1::Scan scan;
  scan.set_name(runtime::NameOf("scans", row.scan_id));
  v1::ScanHeader& header = *scan.mutable_header();
  header.set_scan_id(row.scan_id);
  header.set_machine(runtime::NameOf("machines", row.machine_id));
  header.set_subject(row.artefact_id ? runtime::NameOf("artefacts", *row.artefact_id)
                                     : runtime::NameOf("blades", row.blade_serial.value_or("")));
  header.set_kind(KindOf(row.kind));
  runtime::SetPoint(row.v0_mm, header.mutable_v0_mm());
  header.set_a_deg(row.a_deg);
  header.set_b_deg(row.b_deg);
  header.set_profile_pitch_mm(row.profile_pitch_mm);
  header.set_columns_per_profile(row.columns_per_profile);
  header.set_point_count(row.point_count);
  header.set_encoding(EncodingOf(row.encoding));
  header.set_raw_step_um(row.raw_step_um);
  header.set_arm_series(row.arm_series);
  header.set_clamping(row.clamping);
  header.set_station(row.station);
  if (row.subject_temperature_c) header.set_subject_temperature_c(*row.subject_temperature_c);
  if (row.scales_temperature_c) header.set_scales_temperature_c(*row.scales_temperature_c);
  header.set_sensor_serial_number(row.sensor_serial_number);
  if (row.travel == "FORWARD") header.set_travel(v1::SCAN_TRAVEL_FORWARD);
  if (row.travel == "BACKWARD") header.set_travel(v1::SCAN_TRAVEL_BACKWARD);
  header.set_cloud(CloudOf(row.cloud));
  header.set_length_unit(UnitOf(row.length_unit));
  header.set_sender_error_um(row.sender_error_um);
  header.set_error_bound_um(row.error_bound_um);
  if (row.measured_at) runtime::ToProto(*row.measured_at, header.mutable_measured_at());
  scan.set_block_count(row.block_count);
  scan.set_sha256(row.stored_sha256);
  scan.set_stored_bytes(row.stored_bytes);
  scan.set_proven_error_um(row.proven_error_um);
  runtime::ToProto(row.recorded.recorded_at, scan.mutable_received_at());
  scan.set_record_sequence(row.recorded.sequence);
  scan.set_stored_encoding(EncodingOf(row.stored_encoding));
  scan.set_profile_count(row.profile_count);
  scan.set_sent_sha256(row.sent_sha256);
  return scan;
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
  row.encoding = TextOf(header.encoding());
  row.raw_step_um = header.raw_step_um();
  row.arm_series = header.arm_series();
  row.clamping = header.clamping();
  row.station = header.station();
  if (header.has_subject_temperature_c()) row.subject_temperature_c = header.subject_temperature_c();
  if (header.has_scales_temperature_c()) row.scales_temperature_c = header.scales_temperature_c();
  row.sensor_serial_number = header.sensor_serial_number();
  if (header.travel() != v1::SCAN_TRAVEL_UNSPECIFIED)
    row.travel = v1::ScanTravel_Name(header.travel()).substr(std::string("SCAN_TRAVEL_").size());
  if (header.cloud() != v1::CLOUD_KIND_UNSPECIFIED)
    row.cloud = v1::CloudKind_Name(header.cloud()).substr(kCloudPrefix.size());
  if (header.length_unit() != v1::LENGTH_UNIT_UNSPECIFIED)
    row.length_unit = v1::LengthUnit_Name(header.length_unit()).substr(kUnitPrefix.size());
  // There is no range image of a snapshot.
  const bool as_draco = header.encoding() == v1::ENCODING_DRACO || header.cloud() == v1::CLOUD_KIND_SNAPSHOT;
  row.stored_encoding = TextOf(as_draco ? v1::ENCODING_DRACO : v1::ENCODING_RANGE_IMAGE);
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
