#include "simulator/registry.h"

#include "services/runtime/geometry_proto.h"

namespace sixpoint::simulator {
namespace {

using PlantStub = plant::v1::PlantService::Stub;

void AddJoint(const char* axis, plant::v1::JointKind kind, const Eigen::Vector3d& direction,
              const Eigen::Vector3d& point_mm, double minimum, double maximum,
              google::protobuf::RepeatedPtrField<plant::v1::Joint>* chain) {
  plant::v1::Joint* joint = chain->Add();
  joint->set_axis(axis);
  joint->set_kind(kind);
  runtime::ToProto(direction, joint->mutable_direction());
  if (kind == plant::v1::JOINT_KIND_ROTARY) runtime::ToProto(point_mm, joint->mutable_point_mm());
  joint->set_sign(1);
  joint->set_minimum(minimum);
  joint->set_maximum(maximum);
}

}  // namespace

plant::v1::Machine MachineRecord(const MachineDesign& design) {
  plant::v1::Machine machine;
  auto* part_side = machine.mutable_kinematics()->mutable_part_side();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  AddJoint("A", plant::v1::JOINT_KIND_ROTARY, y, design.centre_mm, -100, 100, part_side);
  AddJoint("B", plant::v1::JOINT_KIND_ROTARY, x, design.centre_mm, -360, 360, part_side);
  // Nothing in a plant is known better; the simulator's axes are perfect.
  for (plant::v1::Joint& joint : *part_side) joint.set_positioning_standard_uncertainty_deg(0.0002);
  auto* tool_side = machine.mutable_kinematics()->mutable_tool_side();
  AddJoint("X", plant::v1::JOINT_KIND_LINEAR, x, {}, -350, 350, tool_side);
  AddJoint("Y", plant::v1::JOINT_KIND_LINEAR, y, {}, -200, 200, tool_side);
  AddJoint("Z", plant::v1::JOINT_KIND_LINEAR, z, {}, -400, 400, tool_side);
  plant::v1::Sensor* sensor = machine.mutable_sensor();
  sensor->set_model("simulated line scanner");
  sensor->set_noise_um(design.scanner.noise_um);
  sensor->set_column_count(design.scanner.columns);
  sensor->set_mid_range_mm(design.scanner.mid_range_mm);
  sensor->set_range_mm(design.scanner.range_mm);
  sensor->set_line_angle_deg(design.scanner.line_angle_deg);
  runtime::ToProto(design.centre_mm, machine.mutable_nominal_centre_mm());
  // A blade clamped by hand is off by up to 1 mm and 1 deg, about 2 mm at a hole; beyond twice that a person looks.
  machine.mutable_safety_envelope()->set_translation_mm(4);
  machine.mutable_safety_envelope()->set_rotation_deg(4);
  machine.mutable_safety_envelope()->set_registration_age_h(design.registration_age_h);
  return machine;
}

plant::v1::Artefact ArtefactRecord(const ArtefactGeometry& geometry) {
  plant::v1::Artefact artefact;
  artefact.set_side_mm(geometry.side_mm);
  artefact.set_cone_half_angle_deg(geometry.cone_half_angle_deg);
  artefact.set_cone_top_radius_mm(geometry.cone_top_radius_mm);
  artefact.set_cone_bottom_radius_mm(geometry.cone_bottom_radius_mm);
  artefact.set_slot_width_mm(geometry.slot_width_mm);
  artefact.set_slot_depth_mm(geometry.slot_depth_mm);
  const auto add = [](const std::string& name, const Eigen::Vector2d& centre, plant::v1::NamedPlanePoint* out) {
    out->set_feature(name);
    out->set_x_mm(centre.x());
    out->set_y_mm(centre.y());
  };
  for (const auto& [name, centre] : geometry.cones_mm) add(name, centre, artefact.add_cones());
  for (const auto& [name, centre] : geometry.slots_mm) add(name, centre, artefact.add_slots());
  return artefact;
}

plant::v1::Part PartRecord(const DesignedPart& designed) {
  plant::v1::Part part;
  part.set_cad_format(plant::v1::CAD_FORMAT_STL);
  part.set_cad_unit_mm(1);
  runtime::ToProto(designed.zero_from_part_nominal, part.mutable_zero_from_part_nominal());
  for (const DesignedHoleGroup& from : designed.hole_groups) {
    plant::v1::HoleGroup* group = part.add_hole_groups();
    group->set_group(from.name);
    group->set_diameter_mm(from.diameter_mm);
    group->set_depth_mm(from.depth_mm);
    group->set_a_nominal_deg(from.a_nominal_deg);
    group->set_b_nominal_deg(from.b_nominal_deg);
    runtime::ToProto(from.axis, group->mutable_axis_in_part());
    group->set_position_tolerance_mm(from.position_tolerance_mm);
    group->set_inclination_tolerance_deg(from.inclination_tolerance_deg);
    group->set_position_zone(plant::v1::POSITION_ZONE_RADIUS);
    // As this machine puts them in: PinIn.
    group->mutable_gauge_pin()->set_diameter_mm(from.diameter_mm);
    group->mutable_gauge_pin()->set_diameter_standard_uncertainty_um(0.5);
    group->mutable_gauge_pin()->set_greatest_play_mm(0);
    for (const DesignedHole& hole : from.holes) {
      plant::v1::Hole* to = group->add_holes();
      to->set_hole(hole.name);
      runtime::ToProto(hole.start_mm, to->mutable_start_in_part_mm());
      runtime::ToProto(hole.normal, to->mutable_normal_in_part());
    }
  }
  for (const DesignedStation& from : designed.stations) {
    plant::v1::Station* station = part.add_stations();
    station->set_station(from.name);
    runtime::ToProto(from.zero_from_part_nominal, station->mutable_zero_from_part_nominal());
  }
  for (const DesignedDatum& datum : designed.six_points) {
    plant::v1::DatumPoint* to = part.add_six_points();
    to->set_datum(datum.name);
    runtime::ToProto(datum.point_mm, to->mutable_point_in_part_mm());
    runtime::ToProto(datum.normal, to->mutable_normal_in_part());
  }
  return part;
}

absl::StatusOr<std::string> RegisterMachine(PlantLink& plant, const std::string& machine_id,
                                            const MachineDesign& design) {
  plant::v1::CreateMachineRequest request;
  request.set_machine_id(machine_id);
  *request.mutable_machine() = MachineRecord(design);
  request.set_request_id(NewRequestId());
  auto machine = plant.Call("plant", &PlantStub::CreateMachine, request);
  if (!machine.ok()) return machine.status();
  return machine->name();
}

absl::StatusOr<std::string> RegisterArtefact(PlantLink& plant, const std::string& artefact_id,
                                             const ArtefactGeometry& geometry) {
  plant::v1::CreateArtefactRequest request;
  request.set_artefact_id(artefact_id);
  *request.mutable_artefact() = ArtefactRecord(geometry);
  request.set_request_id(NewRequestId());
  auto artefact = plant.Call("plant", &PlantStub::CreateArtefact, request);
  if (!artefact.ok()) return artefact.status();
  return artefact->name();
}

absl::StatusOr<std::string> RegisterPart(PlantLink& plant, const std::string& part_id, const DesignedPart& part) {
  plant::v1::CreatePartRequest request;
  request.set_part_id(part_id);
  *request.mutable_part() = PartRecord(part);
  request.set_cad(BinaryStl(part.mesh));
  request.set_request_id(NewRequestId());
  auto created = plant.Call("plant", &PlantStub::CreatePart, request);
  if (!created.ok()) return created.status();
  return created->name();
}

absl::StatusOr<std::string> RegisterBlade(PlantLink& plant, const std::string& serial, const std::string& part) {
  plant::v1::CreateBladeRequest request;
  request.set_serial(serial);
  request.set_part(part);
  request.set_request_id(NewRequestId());
  auto blade = plant.Call("plant", &PlantStub::CreateBlade, request);
  if (!blade.ok()) return blade.status();
  return blade->name();
}

}  // namespace sixpoint::simulator
