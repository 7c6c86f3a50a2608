#include "services/inspection/section_messages.h"

#include <string>

#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"
#include "sixpoint/registration/v1/method.pb.h"

namespace sixpoint::inspection {
namespace {

absl::Status Fill(const storage::SectionValueRow& row, const std::string& what, v1::SectionValue* out) {
  const auto parameter = runtime::StoredEnum<v1::SectionParameter>(row.parameter, what);
  if (!parameter.ok()) return parameter.status();
  const auto unit = runtime::StoredEnum<v1::SectionUnit>(row.unit, what);
  if (!unit.ok()) return unit.status();
  out->set_parameter(*parameter);
  out->set_unit(*unit);
  if (row.nominal) out->set_nominal(*row.nominal);
  if (row.value) out->set_value(*row.value);
  if (row.expanded_uncertainty) out->set_expanded_uncertainty(*row.expanded_uncertainty);
  if (row.by_noise) out->set_by_noise(*row.by_noise);
  if (row.by_form) out->set_by_form(*row.by_form);
  if (row.by_pose) out->set_by_pose(*row.by_pose);
  out->set_reason(row.reason);
  return absl::OkStatus();
}

absl::StatusOr<v1::SectionEnd> EndOf(const std::string& text, const std::string& what) {
  return runtime::StoredEnum<v1::SectionEnd>(text, what);
}

absl::Status Fill(const storage::SectionRow& row, const std::string& what, v1::Section* out) {
  v1::SectionPlane& plane = *out->mutable_plane();
  plane.set_section(row.section);
  runtime::SetPoint(row.origin_in_part_mm, plane.mutable_origin_in_part_mm());
  runtime::SetDirection(row.normal_in_part, plane.mutable_normal_in_part());
  runtime::SetDirection(row.reference_in_part, plane.mutable_reference_in_part());
  if (!row.leading_in_part_mm.empty()) runtime::SetPoint(row.leading_in_part_mm, plane.mutable_leading_in_part_mm());
  if (!row.near_in_part_mm.empty()) runtime::SetPoint(row.near_in_part_mm, plane.mutable_near_in_part_mm());
  out->set_point_count(row.point_count);
  out->set_outlier_count(row.outlier_count);
  out->set_reason(row.reason);
  for (const storage::SectionValueRow& value : row.values)
    if (absl::Status status = Fill(value, what, out->add_values()); !status.ok()) return status;
  if (!row.found) return absl::OkStatus();
  const auto leading = EndOf(row.found->leading_end, what), trailing = EndOf(row.found->trailing_end, what);
  if (!leading.ok()) return leading.status();
  if (!trailing.ok()) return trailing.status();
  out->set_leading(*leading);
  out->set_trailing(*trailing);
  out->set_noise_um(row.found->noise_um);
  out->set_waver_um(row.found->waver_um);
  out->set_waver_length_mm(row.found->waver_length_mm);
  out->set_gap_share(row.found->gap_share);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<v1::SectionMeasurement> ToProto(const storage::SectionMeasurementRow& row) {
  v1::SectionMeasurement measurement;
  const std::string what = "section measurement " + row.section_measurement_id;
  measurement.set_name(runtime::NameOf("sections", row.section_measurement_id));
  measurement.set_blade(runtime::NameOf("blades", row.blade_serial));
  measurement.set_registration(runtime::NameOf("registrations", row.registration_id));
  measurement.set_part(runtime::NameOf("parts", row.part_id));
  measurement.set_part_revision(row.part_revision);
  const auto method = runtime::StoredEnum<registration::v1::Method>(row.method, what);
  if (!method.ok()) return method.status();
  measurement.set_method(*method);
  for (const std::string& scan : row.scan_ids) measurement.add_scans(runtime::NameOf("scans", scan));
  measurement.set_half_width_mm(row.half_width_mm);
  measurement.set_reference_section(row.reference_section);
  if (row.neighbour_standard_uncertainty_um) {
    runtime::SetPoint(row.neighbour_offset_in_part_mm, measurement.mutable_neighbour()->mutable_offset_in_part_mm());
    measurement.mutable_neighbour()->set_standard_uncertainty_um(*row.neighbour_standard_uncertainty_um);
  }
  for (const storage::SectionRow& section : row.sections)
    if (absl::Status status = Fill(section, what, measurement.add_sections()); !status.ok()) return status;
  measurement.set_outlines_sha256(row.outlines_sha256);
  measurement.set_requested_by(row.requested_by);
  measurement.set_software_version(row.software_version);
  measurement.set_computed_on(row.computed_on);
  runtime::ToProto(row.recorded.recorded_at, measurement.mutable_recorded_at());
  measurement.set_record_sequence(row.recorded.sequence);
  measurement.set_work_order(row.work_order);
  measurement.set_operation(row.operation);
  return measurement;
}

v1::SectionOutline ToProto(const std::string& section, const storage::SectionOutlineRow& row) {
  v1::SectionOutline out;
  out.set_section(section);
  runtime::SetTransform(row.part_from_section, out.mutable_part_from_section());
  out.mutable_nominal_mm()->Add(row.nominal_mm.begin(), row.nominal_mm.end());
  out.mutable_measured_mm()->Add(row.measured_mm.begin(), row.measured_mm.end());
  out.mutable_deviations_um()->Add(row.deviations_um.begin(), row.deviations_um.end());
  for (const std::int64_t gap : row.gaps_before) out.add_gaps_before(static_cast<int>(gap));
  return out;
}

void LeaveBasic(v1::SectionMeasurement* measurement) {
  for (v1::Section& section : *measurement->mutable_sections()) section.clear_values();
}

v1::MeasureSectionsRequest RequestOf(const v1::SectionMeasurement& recorded) {
  v1::MeasureSectionsRequest request;
  request.set_registration(recorded.registration());
  request.set_half_width_mm(recorded.half_width_mm());
  for (const v1::Section& section : recorded.sections()) *request.add_sections() = section.plane();
  request.set_reference_section(recorded.reference_section());
  if (recorded.has_neighbour()) *request.mutable_neighbour() = recorded.neighbour();
  return request;
}

}  // namespace sixpoint::inspection
