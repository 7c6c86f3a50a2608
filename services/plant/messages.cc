#include "services/plant/messages.h"

#include <google/protobuf/util/json_util.h>

#include "services/plant/model_template.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/shape_region_proto.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::plant {
namespace {

void Fill(const storage::CertificateRow& row, v1::Certificate* out) {
  out->set_number(row.number);
  runtime::ToProto(row.calibrated_at, out->mutable_calibrated_at());
  runtime::ToProto(row.expires_at, out->mutable_expires_at());
}

void Fill(const storage::ExpansionRow& row, v1::ThermalExpansion* out) {
  out->set_um_per_m_k(row.um_per_m_k);
  out->set_standard_uncertainty_um_per_m_k(row.standard_uncertainty_um_per_m_k);
}

// Unset where nothing is stated.
void SetErrorSources(const storage::MachineRow& row, runtime::StoredWords* words, v1::Machine* machine) {
  v1::ErrorSources sources;
  sources.set_approach(words->ValueOrNone<v1::Approach>(row.approach));
  if (row.touch_offset_um) sources.set_touch_offset_um(*row.touch_offset_um);
  if (row.scanner_field_um) sources.set_scanner_field_um(*row.scanner_field_um);
  if (row.tool_offset_um) sources.set_tool_offset_um(*row.tool_offset_um);
  if (row.linear_scale_um_per_m) sources.set_linear_scale_um_per_m(*row.linear_scale_um_per_m);
  if (row.squareness_um_per_m) sources.set_squareness_um_per_m(*row.squareness_um_per_m);
  if (row.temperature_k) sources.set_temperature_k(*row.temperature_k);
  if (row.temperature_half_range_k) sources.set_temperature_half_range_k(*row.temperature_half_range_k);
  if (row.encoder_latency_um) sources.set_encoder_latency_um(*row.encoder_latency_um);
  if (row.scale_expansion) Fill(*row.scale_expansion, sources.mutable_scale_expansion());
  if (sources.ByteSizeLong() > 0) *machine->mutable_error_sources() = std::move(sources);
}

void Fill(const storage::JointRow& row, runtime::StoredWords* words, v1::Joint* out) {
  out->set_axis(row.axis);
  out->set_kind(words->Value<v1::JointKind>(row.kind));
  runtime::SetDirection(row.direction, out->mutable_direction());
  if (row.point_mm) runtime::SetPoint(*row.point_mm, out->mutable_point_mm());
  out->set_sign(row.sign);
  out->set_minimum(row.minimum);
  out->set_maximum(row.maximum);
  if (row.positioning_standard_uncertainty_deg)
    out->set_positioning_standard_uncertainty_deg(*row.positioning_standard_uncertainty_deg);
}

void Fill(const storage::HoleGroupRow& row, runtime::StoredWords* words, v1::HoleGroup* out) {
  out->set_group(row.group);
  out->set_diameter_mm(row.diameter_mm);
  out->set_depth_mm(row.depth_mm);
  out->set_a_nominal_deg(row.a_nominal_deg);
  out->set_b_nominal_deg(row.b_nominal_deg);
  runtime::SetDirection(row.axis_in_part, out->mutable_axis_in_part());
  out->set_position_tolerance_mm(row.position_tolerance_mm);
  out->set_inclination_tolerance_deg(row.inclination_tolerance_deg);
  out->set_position_zone(words->Value<v1::PositionZone>(row.position_zone));
  if (row.gauge_pin) {
    out->mutable_gauge_pin()->set_diameter_mm(row.gauge_pin->diameter_mm);
    out->mutable_gauge_pin()->set_diameter_standard_uncertainty_um(row.gauge_pin->diameter_standard_uncertainty_um);
    out->mutable_gauge_pin()->set_greatest_play_mm(row.gauge_pin->greatest_play_mm);
    if (row.gauge_pin->least_depth_mm) out->mutable_gauge_pin()->set_least_depth_mm(*row.gauge_pin->least_depth_mm);
    if (row.gauge_pin->certificate) Fill(*row.gauge_pin->certificate, out->mutable_gauge_pin()->mutable_certificate());
  }
  if (row.pin_standing) {
    v1::PinStanding& standing = *out->mutable_pin_standing();
    standing.set_clearance_standard_uncertainty_um(row.pin_standing->clearance_standard_uncertainty_um);
    standing.set_tilt_standard_uncertainty_deg(row.pin_standing->tilt_standard_uncertainty_deg);
  }
  for (const storage::HoleRow& hole : row.holes) {
    v1::Hole* to = out->add_holes();
    to->set_hole(hole.hole);
    runtime::SetPoint(hole.start_in_part_mm, to->mutable_start_in_part_mm());
    runtime::SetDirection(hole.normal_in_part, to->mutable_normal_in_part());
  }
}

void Fill(const storage::TessellationRow& row, v1::SurfaceSummary* out) {
  out->set_cad_sha256(row.cad_sha256);
  out->set_surface_sha256(row.surface_sha256);
  out->set_triangle_count(row.triangle_count);
  out->set_chordal_error_um(row.chordal_error_um);
  out->set_closed(row.closed);
  runtime::SetPoint(row.minimum_mm, out->mutable_minimum_mm());
  runtime::SetPoint(row.maximum_mm, out->mutable_maximum_mm());
  if (row.edge_gaps) {
    out->set_healed_um(row.edge_gaps->healed_um);
    out->set_gap_um(row.edge_gaps->gap_um);
    if (!row.edge_gaps->gap_at_mm.empty()) runtime::SetPoint(row.edge_gaps->gap_at_mm, out->mutable_gap_at_mm());
  }
  if (!row.gaps) return;
  out->set_degenerate_triangle_count(row.gaps->degenerate_triangle_count);
  out->set_open_rim_count(row.gaps->open_rim_count);
  out->set_open_rim_length_mm(row.gaps->open_rim_length_mm);
}

// Of a part or a station.
template <typename Row>
void SetNominal(const Row& row, geometry::v1::RigidTransform* nominal) {
  for (const double value : row.zero_from_part_nominal_rotation) nominal->add_rotation(value);
  runtime::SetPoint(row.zero_from_part_nominal_translation_mm, nominal->mutable_translation_mm());
}

void Fill(const storage::StationRow& row, v1::Station* station) {
  station->set_station(row.station);
  SetNominal(row, station->mutable_zero_from_part_nominal());
  station->set_capture_mm(row.capture_mm);
}

}  // namespace

absl::StatusOr<v1::Machine> ToProto(const storage::MachineRow& row) {
  runtime::StoredWords words("machine " + row.machine_id);
  v1::Machine machine;
  machine.set_name(runtime::NameOf("machines", row.machine_id));
  machine.set_revision(row.revision);
  for (const storage::JointRow& joint : row.joints) {
    v1::Kinematics* kinematics = machine.mutable_kinematics();
    Fill(joint, &words, joint.side == "part" ? kinematics->add_part_side() : kinematics->add_tool_side());
  }
  v1::Sensor* sensor = machine.mutable_sensor();
  sensor->set_model(row.sensor_model);
  sensor->set_noise_um(row.sensor_noise_um);
  sensor->set_column_count(row.sensor_column_count);
  sensor->set_mid_range_mm(row.sensor_mid_range_mm);
  sensor->set_range_mm(row.sensor_range_mm);
  sensor->set_line_angle_deg(row.sensor_line_angle_deg);
  sensor->set_serial_number(row.sensor_serial_number);
  sensor->set_kind(words.ValueOrNone<v1::SensorKind>(row.sensor_kind));
  runtime::SetPoint(row.nominal_centre_mm, machine.mutable_nominal_centre_mm());
  v1::SafetyEnvelope* envelope = machine.mutable_safety_envelope();
  envelope->set_translation_mm(row.safety_translation_mm);
  envelope->set_rotation_deg(row.safety_rotation_deg);
  envelope->set_uncertainty_share(row.safety_uncertainty_share);
  envelope->set_registration_age_h(row.safety_registration_age_h);
  envelope->set_keep_out_mm(row.safety_keep_out_mm);
  if (row.interim_check_limit_um) envelope->set_interim_check_limit_um(*row.interim_check_limit_um);
  SetErrorSources(row, &words, &machine);
  if (!row.touch_probe_serial_number.empty()) {
    machine.mutable_touch_probe()->set_serial_number(row.touch_probe_serial_number);
    if (row.touch_probe_certificate)
      Fill(*row.touch_probe_certificate, machine.mutable_touch_probe()->mutable_certificate());
  }
  runtime::ToProto(row.recorded.recorded_at, machine.mutable_created_at());
  return words.Checked(std::move(machine));
}

v1::Artefact ToProto(const storage::ArtefactRow& row) {
  v1::Artefact artefact;
  artefact.set_name(runtime::NameOf("artefacts", row.artefact_id));
  artefact.set_revision(row.revision);
  artefact.set_side_mm(row.side_mm);
  artefact.set_cone_half_angle_deg(row.cone_half_angle_deg);
  artefact.set_cone_top_radius_mm(row.cone_top_radius_mm);
  artefact.set_cone_bottom_radius_mm(row.cone_bottom_radius_mm);
  artefact.set_slot_width_mm(row.slot_width_mm);
  artefact.set_slot_depth_mm(row.slot_depth_mm);
  for (const storage::PlateFeatureRow& feature : row.features) {
    v1::NamedPlanePoint* to = feature.kind == "cone" ? artefact.add_cones() : artefact.add_slots();
    to->set_feature(feature.feature);
    to->set_x_mm(feature.x_mm);
    to->set_y_mm(feature.y_mm);
  }
  artefact.set_serial_number(row.serial_number);
  if (row.certificate) Fill(*row.certificate, artefact.mutable_certificate());
  if (row.centre_standard_uncertainty_um)
    artefact.set_centre_standard_uncertainty_um(*row.centre_standard_uncertainty_um);
  if (row.flatness_standard_uncertainty_um)
    artefact.set_flatness_standard_uncertainty_um(*row.flatness_standard_uncertainty_um);
  runtime::ToProto(row.recorded.recorded_at, artefact.mutable_created_at());
  return artefact;
}

absl::StatusOr<v1::Part> ToProto(const storage::PartRow& row) {
  runtime::StoredWords words("part " + row.part_id);
  v1::Part part;
  part.set_name(runtime::NameOf("parts", row.part_id));
  part.set_revision(row.revision);
  part.set_customer(row.customer_id);
  part.set_cad_format(words.Value<v1::CadFormat>(row.cad_format));
  part.set_cad_unit_mm(row.cad_unit_mm);
  part.set_solid(row.solid);
  for (const storage::HoleGroupRow& group : row.hole_groups) Fill(group, &words, part.add_hole_groups());
  for (const storage::DatumPointRow& datum : row.datum_points) {
    v1::DatumPoint* to = part.add_six_points();
    to->set_datum(datum.datum);
    runtime::SetPoint(datum.point_in_part_mm, to->mutable_point_in_part_mm());
    runtime::SetDirection(datum.normal_in_part, to->mutable_normal_in_part());
  }
  SetNominal(row, part.mutable_zero_from_part_nominal());
  for (const storage::StationRow& station : row.stations) Fill(station, part.add_stations());
  for (const storage::ShapeRegionRow& region : row.shape_regions)
    runtime::ToProto(region, &words, part.add_shape_regions());
  if (row.thermal_expansion) Fill(*row.thermal_expansion, part.mutable_thermal_expansion());
  Fill(row.tessellation, part.mutable_surface());
  runtime::ToProto(row.recorded.recorded_at, part.mutable_created_at());
  return words.Checked(std::move(part));
}

namespace {

v1::ToolPath PathOf(const storage::MachiningToolPathRow& row) {
  v1::ToolPath path;
  path.set_path(row.path);
  path.set_a_nominal_deg(row.a_nominal_deg);
  path.set_b_nominal_deg(row.b_nominal_deg);
  path.set_position_tolerance_mm(row.position_tolerance_mm);
  path.set_inclination_tolerance_deg(row.inclination_tolerance_deg);
  path.set_mouth_mm(row.mouth_mm);
  if (row.greatest_step_deg) path.set_greatest_step_deg(*row.greatest_step_deg);
  for (std::size_t i = 0; i + 2 < row.tips_in_part_mm.size(); i += 3) {
    v1::ToolPose& pose = *path.add_poses();
    runtime::SetPoint({&row.tips_in_part_mm[i], 3}, pose.mutable_tip_in_part_mm());
    runtime::SetDirection({&row.axes_in_part[i], 3}, pose.mutable_axis_in_part());
  }
  return path;
}

}  // namespace

v1::MachiningModel ToProto(const storage::MachiningModelRow& row) {
  v1::MachiningModel model;
  model.set_name(runtime::NameOf("machining_models", row.machining_model_id));
  model.set_revision(row.revision);
  model.set_part(runtime::NameOf("parts", row.part_id));
  model.set_part_revision(row.part_revision);
  for (const storage::MachiningOperationRow& operation : row.operations) {
    v1::MachiningOperation& to = *model.add_operations();
    to.set_operation(operation.operation);
    to.set_hole_group(operation.hole_group);
    to.mutable_electrode()->set_diameter_mm(operation.electrode_diameter_mm);
    to.mutable_electrode()->set_length_mm(operation.electrode_length_mm);
    to.mutable_electrode()->set_wear_mm(operation.electrode_wear_mm);
    for (const storage::MachiningToolPathRow& path : operation.paths) *to.add_paths() = PathOf(path);
    if (operation.tool_number) to.set_tool_number(*operation.tool_number);
    if (operation.feed_mm_min) to.set_feed_mm_min(*operation.feed_mm_min);
  }
  if (row.w_mm) model.set_w_mm(*row.w_mm);
  model.set_nc_template(row.nc_template);
  model.set_nc_template_sha256(row.nc_template_sha256);
  for (const storage::WorkOffsetRow& one : row.work_offsets) {
    v1::WorkOffset& to = *model.add_work_offsets();
    to.set_code(one.code);
    to.set_x_mm(one.offset[0]);
    to.set_y_mm(one.offset[1]);
    to.set_z_mm(one.offset[2]);
    to.set_a_deg(one.offset[3]);
    to.set_b_deg(one.offset[4]);
  }
  for (const storage::ToolLengthRow& one : row.tool_lengths) {
    v1::ToolLength& to = *model.add_tool_lengths();
    to.set_number(one.number);
    to.set_length_mm(one.length_mm);
  }
  if (row.post_processor) *model.mutable_post_processor() = ToProto(*row.post_processor);
  runtime::ToProto(row.recorded.recorded_at, model.mutable_created_at());
  return model;
}

void LeaveBasic(v1::Machine* machine) { machine->clear_kinematics(); }

void LeaveBasic(v1::Artefact* artefact) {
  artefact->clear_cones();
  artefact->clear_slots();
}

void LeaveBasic(v1::Part* part) {
  part->clear_hole_groups();
  part->clear_six_points();
  part->clear_stations();
  part->clear_shape_regions();
}

void LeaveBasic(v1::MachiningModel* model) {
  model->clear_operations();
  model->clear_work_offsets();
  model->clear_tool_lengths();
}

v1::Blade ToProto(const storage::BladeRow& row) {
  v1::Blade blade;
  blade.set_name(runtime::NameOf("blades", row.blade_serial));
  blade.set_part(runtime::NameOf("parts", row.part_id));
  runtime::ToProto(row.recorded.recorded_at, blade.mutable_created_at());
  blade.set_work_order(row.work_order);
  blade.set_operation(row.operation);
  return blade;
}

v1::RecordEntry ToProto(const storage::JournalEntry& entry) {
  v1::RecordEntry out;
  out.set_record_sequence(entry.recorded.sequence);
  out.set_kind(entry.entry.kind);
  out.set_work_order(entry.entry.work_order);
  out.set_operation(entry.entry.operation);
  out.set_name(entry.entry.name);
  for (const std::string& input : entry.entry.inputs) out.add_inputs(input);
  out.set_method(entry.entry.method);
  out.set_software_version(entry.entry.software_version);
  runtime::ToProto(entry.recorded.recorded_at, out.mutable_recorded_at());
  if (entry.entry.blade) out.set_blade(runtime::NameOf("blades", *entry.entry.blade));
  if (entry.entry.machine) out.set_machine(runtime::NameOf("machines", *entry.entry.machine));
  out.set_requested_by(entry.entry.requested_by);
  if (entry.entry.trace_id) out.set_trace_id(*entry.entry.trace_id);
  out.set_verdict(entry.verdict);
  out.set_state(entry.state);
  if (entry.entry.measured_at) runtime::ToProto(*entry.entry.measured_at, out.mutable_measured_at());
  // The database holds JSON objects only; one that does not parse would be a summary less, never a record less.
  if (!google::protobuf::util::JsonStringToMessage(entry.entry.summary_json, out.mutable_summary()).ok())
    out.mutable_summary()->Clear();
  return out;
}

v1::Event ToProto(const storage::EventRow& row) {
  v1::Event out;
  *out.mutable_entry() = ToProto(row.entry);
  if (row.valid_until) runtime::ToProto(*row.valid_until, out.mutable_valid_until());
  return out;
}

}  // namespace sixpoint::plant
