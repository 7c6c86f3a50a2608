#include "tests/services/plant/sample_registry.h"

#include <cmath>

namespace sixpoint::plant {
namespace {

void AddJoint(const std::string& axis, v1::JointKind kind, double x, double y, double z,
              google::protobuf::RepeatedPtrField<v1::Joint>* joints) {
  v1::Joint* joint = joints->Add();
  joint->set_axis(axis);
  joint->set_kind(kind);
  joint->mutable_direction()->set_x(x);
  joint->mutable_direction()->set_y(y);
  joint->mutable_direction()->set_z(z);
  if (kind == v1::JOINT_KIND_ROTARY) joint->mutable_point_mm()->set_x_mm(26.6352);
  joint->set_sign(1);
  joint->set_minimum(-100);
  joint->set_maximum(100);
}

void Set(double x, double y, double z, geometry::v1::Point* out) {
  out->set_x_mm(x);
  out->set_y_mm(y);
  out->set_z_mm(z);
}

void Set(double x, double y, double z, geometry::v1::Direction* out) {
  out->set_x(x);
  out->set_y(y);
  out->set_z(z);
}

void Set(double um_per_m_k, double standard_uncertainty_um_per_m_k, v1::ThermalExpansion* out) {
  out->set_um_per_m_k(um_per_m_k);
  out->set_standard_uncertainty_um_per_m_k(standard_uncertainty_um_per_m_k);
}

void Set(const std::string& number, v1::Certificate* out) {
  out->set_number(number);
  out->mutable_calibrated_at()->set_seconds(1'700'000'000);
  out->mutable_expires_at()->set_seconds(4'000'000'000);
}

}  // namespace

v1::CreateMachineRequest SampleMachine() {
  v1::CreateMachineRequest request;
  request.set_machine_id("m1");
  v1::Machine& machine = *request.mutable_machine();
  AddJoint("A", v1::JOINT_KIND_ROTARY, 0, 1, 0, machine.mutable_kinematics()->mutable_part_side());
  AddJoint("B", v1::JOINT_KIND_ROTARY, 1, 0, 0, machine.mutable_kinematics()->mutable_part_side());
  AddJoint("X", v1::JOINT_KIND_LINEAR, 1, 0, 0, machine.mutable_kinematics()->mutable_tool_side());
  machine.mutable_sensor()->set_model("scanCONTROL 2960-25");
  machine.mutable_sensor()->set_noise_um(2);
  machine.mutable_sensor()->set_column_count(1280);
  machine.mutable_sensor()->set_mid_range_mm(66);
  machine.mutable_sensor()->set_range_mm(25);
  machine.mutable_sensor()->set_line_angle_deg(20);
  Set(26.6352, 54.8952, -1.0 / 3, machine.mutable_nominal_centre_mm());
  machine.mutable_safety_envelope()->set_translation_mm(2);
  machine.mutable_safety_envelope()->set_rotation_deg(3);
  machine.mutable_safety_envelope()->set_uncertainty_share(0.25);
  machine.mutable_safety_envelope()->set_registration_age_h(12);
  machine.mutable_safety_envelope()->set_keep_out_mm(0.4);
  machine.mutable_error_sources()->set_approach(v1::APPROACH_DOWNWARDS);
  machine.mutable_error_sources()->set_touch_offset_um(0.6);
  v1::ErrorSources& sources = *machine.mutable_error_sources();
  sources.set_scanner_field_um(2);
  sources.set_tool_offset_um(1.5);
  machine.mutable_safety_envelope()->set_interim_check_limit_um(20);
  sources.set_linear_scale_um_per_m(5);
  sources.set_squareness_um_per_m(7);
  sources.set_temperature_k(0.2);
  sources.set_temperature_half_range_k(3);
  sources.set_encoder_latency_um(4);
  Set(8, 0.5, sources.mutable_scale_expansion());
  machine.mutable_kinematics()->mutable_part_side(0)->set_positioning_standard_uncertainty_deg(0.005);
  machine.mutable_sensor()->set_serial_number("2960-25-0815");
  machine.mutable_sensor()->set_kind(v1::SENSOR_KIND_LINE);
  machine.mutable_touch_probe()->set_serial_number("TP-1");
  Set("T-77", machine.mutable_touch_probe()->mutable_certificate());
  return request;
}

v1::CreateArtefactRequest SampleArtefact() {
  v1::CreateArtefactRequest request;
  request.set_artefact_id("plate");
  v1::Artefact& artefact = *request.mutable_artefact();
  artefact.set_side_mm(24);
  artefact.set_cone_half_angle_deg(45);
  artefact.set_cone_top_radius_mm(2);
  artefact.set_cone_bottom_radius_mm(0.5);
  artefact.set_slot_width_mm(2.4);
  artefact.set_slot_depth_mm(0.8);
  for (int i = 0; i < 3; ++i) {
    v1::NamedPlanePoint* cone = artefact.add_cones();
    cone->set_feature("C" + std::to_string(i + 1));
    cone->set_x_mm(3.5 * std::cos(i));
    cone->set_y_mm(3.5 * std::sin(i));
  }
  v1::NamedPlanePoint* slot = artefact.add_slots();
  slot->set_feature("Q1");
  slot->set_x_mm(-1.0 / 3);
  artefact.set_serial_number("A-7");
  Set("D-1201", artefact.mutable_certificate());
  artefact.set_centre_standard_uncertainty_um(0.5);
  return request;
}

v1::CreatePartRequest SamplePart(const std::string& cad) {
  v1::CreatePartRequest request;
  request.set_part_id("vane");
  request.set_cad(cad);
  v1::Part& part = *request.mutable_part();
  part.set_cad_format(v1::CAD_FORMAT_STEP);
  part.set_cad_unit_mm(1);
  for (const double value : {0, 0, 1, 1, 0, 0, 0, 1, 0}) part.mutable_zero_from_part_nominal()->add_rotation(value);
  Set(0.1, -270.0429049226093, 1e-9, part.mutable_zero_from_part_nominal()->mutable_translation_mm());
  v1::HoleGroup* group = part.add_hole_groups();
  group->set_group("G1");
  group->set_diameter_mm(0.44);
  group->set_depth_mm(6);
  group->set_a_nominal_deg(1.847978);
  group->set_b_nominal_deg(-40.357562);
  Set(0.6, 0.8, 0, group->mutable_axis_in_part());
  group->set_position_tolerance_mm(0.1);
  group->set_inclination_tolerance_deg(0.5);
  group->set_position_zone(v1::POSITION_ZONE_DIAMETER);
  group->mutable_gauge_pin()->set_diameter_mm(0.4381);
  group->mutable_gauge_pin()->set_diameter_standard_uncertainty_um(0.3);
  group->mutable_gauge_pin()->set_greatest_play_mm(0.005);
  group->mutable_gauge_pin()->set_least_depth_mm(2.5);
  Set("P-3", group->mutable_gauge_pin()->mutable_certificate());
  Set(12.5, 0.5, part.mutable_thermal_expansion());
  group->mutable_pin_standing()->set_clearance_standard_uncertainty_um(2);
  group->mutable_pin_standing()->set_tilt_standard_uncertainty_deg(0.03);
  for (int i = 0; i < 3; ++i) {
    v1::Hole* hole = group->add_holes();
    hole->set_hole("H" + std::to_string(i + 1));
    Set(3, 4, 5 + i / 3.0, hole->mutable_start_in_part_mm());
    Set(0.6, 0.8, 0, hole->mutable_normal_in_part());
  }
  for (int i = 0; i < 6; ++i) {
    v1::DatumPoint* datum = part.add_six_points();
    datum->set_datum("D" + std::to_string(i + 1));
    Set(5 * std::cos(i), 5 * std::sin(i), 3.0 * i, datum->mutable_point_in_part_mm());
    Set(std::cos(i), std::sin(i), 0, datum->mutable_normal_in_part());
  }
  return request;
}

v1::CreateMachiningModelRequest SampleModel() {
  v1::CreateMachiningModelRequest request;
  request.set_machining_model_id("vane-edm");
  v1::MachiningModel& model = *request.mutable_machining_model();
  model.set_part("parts/vane");
  v1::MachiningOperation& operation = *model.add_operations();
  operation.set_operation("OP10");
  operation.set_hole_group("G1");
  operation.mutable_electrode()->set_diameter_mm(0.4);
  operation.mutable_electrode()->set_length_mm(30);
  operation.mutable_electrode()->set_wear_mm(0.25);
  model.set_w_mm(12.5);
  for (const char* hole : {"H1", "H2", "H3"})
    model.mutable_nc_template()->append("X1.5 Y2 Z3 A4 B5 (SIXPOINT G1/" + std::string(hole) + ")\n");
  v1::WorkOffset& offset = *model.add_work_offsets();
  offset.set_code("G55");
  offset.set_x_mm(1);
  offset.set_y_mm(2);
  offset.set_z_mm(-3.125);
  offset.set_a_deg(4);
  offset.set_b_deg(5);
  v1::ToolLength& tool = *model.add_tool_lengths();
  tool.set_number(7);
  tool.set_length_mm(120.5);
  return request;
}

}  // namespace sixpoint::plant
