#include "bench/ingest/registry.h"

#include <array>
#include <cstring>

#include "bench/ingest/scan_source.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "storage/database.h"

namespace sixpoint::bench {
namespace {

using Plant = plant::v1::PlantService::Stub;

constexpr double kPatience_s = 60;

void AddJoint(const char* axis, const Eigen::Vector3d& direction, double limit_deg,
              google::protobuf::RepeatedPtrField<plant::v1::Joint>* chain) {
  plant::v1::Joint* joint = chain->Add();
  joint->set_axis(axis);
  joint->set_kind(plant::v1::JOINT_KIND_ROTARY);
  runtime::ToProto(direction, joint->mutable_direction());
  runtime::ToProto(Eigen::Vector3d(0, 0, 0), joint->mutable_point_mm());
  joint->set_sign(1);
  joint->set_minimum(-limit_deg);
  joint->set_maximum(limit_deg);
  joint->set_positioning_standard_uncertainty_deg(0.001);
}

plant::v1::Machine MachineRecord() {
  plant::v1::Machine machine;
  AddJoint("A", Eigen::Vector3d::UnitY(), 100, machine.mutable_kinematics()->mutable_part_side());
  AddJoint("B", Eigen::Vector3d::UnitX(), 360, machine.mutable_kinematics()->mutable_part_side());
  plant::v1::Sensor* sensor = machine.mutable_sensor();
  sensor->set_model("scanCONTROL 2960-25");
  sensor->set_noise_um(kNoiseUm);
  sensor->set_column_count(kColumnCount);
  sensor->set_mid_range_mm(kMidRangeMm);
  sensor->set_range_mm(kRangeMm);
  sensor->set_line_angle_deg(kLineAngleDeg);
  runtime::ToProto(Eigen::Vector3d(0, 0, 0), machine.mutable_nominal_centre_mm());
  machine.mutable_safety_envelope()->set_translation_mm(4);
  machine.mutable_safety_envelope()->set_rotation_deg(4);
  return machine;
}

// A tetrahedron: the ingest service asks only for the part's tolerances.
std::string SmallStl() {
  const std::array<Eigen::Vector3f, 4> corners = {Eigen::Vector3f(0, 0, 0), Eigen::Vector3f(40, 0, 0),
                                                  Eigen::Vector3f(0, 40, 0), Eigen::Vector3f(0, 0, 40)};
  const std::array<std::array<int, 3>, 4> faces = {{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  std::string bytes(80, '\0');
  const std::uint32_t count = faces.size();
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  for (const auto& face : faces) {
    bytes.append(12, '\0');  // the normal: readers take it from the corners
    for (const int corner : face) {
      bytes.append(reinterpret_cast<const char*>(corners[static_cast<std::size_t>(corner)].data()), 12);
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

plant::v1::CreatePartRequest Part() {
  plant::v1::CreatePartRequest request;
  request.set_part_id("bench");
  request.set_cad(SmallStl());
  plant::v1::Part* part = request.mutable_part();
  part->set_cad_format(plant::v1::CAD_FORMAT_STL);
  part->set_cad_unit_mm(1);
  runtime::ToProto(Eigen::Isometry3d::Identity(), part->mutable_zero_from_part_nominal());
  plant::v1::HoleGroup* group = part->add_hole_groups();
  group->set_group("G1");
  group->set_diameter_mm(0.5);
  group->set_depth_mm(2);
  runtime::ToProto(Eigen::Vector3d(0, 0, -1), group->mutable_axis_in_part());
  group->set_position_tolerance_mm(0.08);
  group->set_inclination_tolerance_deg(0.5);
  group->set_position_zone(plant::v1::POSITION_ZONE_RADIUS);
  plant::v1::Hole* hole = group->add_holes();
  hole->set_hole("H1");
  runtime::ToProto(Eigen::Vector3d(10, 10, 0), hole->mutable_start_in_part_mm());
  runtime::ToProto(Eigen::Vector3d(0, 0, -1), hole->mutable_normal_in_part());
  return request;
}

template <typename Request, typename Response>
absl::Status Create(Plant* plant, grpc::Status (Plant::*method)(grpc::ClientContext*, const Request&, Response*),
                    Request request) {
  request.set_request_id(storage::NewUuid());
  Response response;
  const auto context = runtime::ContextFor(kPatience_s);
  context->set_wait_for_ready(true);
  return runtime::FromGrpc((plant->*method)(context.get(), request, &response));
}

}  // namespace

absl::Status Register(const Endpoint& plant, int machine_count) {
  const auto stub = plant::v1::PlantService::NewStub(runtime::ConnectTo(plant.address, plant.credentials));
  for (int i = 0; i < machine_count; ++i) {
    plant::v1::CreateMachineRequest request;
    request.set_machine_id("bench-" + std::to_string(i));
    *request.mutable_machine() = MachineRecord();
    if (absl::Status made = Create(stub.get(), &Plant::CreateMachine, request); !made.ok()) return made;
  }
  if (absl::Status made = Create(stub.get(), &Plant::CreatePart, Part()); !made.ok()) return made;
  plant::v1::CreateBladeRequest blade;
  blade.set_serial("bench");
  blade.set_part("parts/bench");
  return Create(stub.get(), &Plant::CreateBlade, blade);
}

}  // namespace sixpoint::bench
