#include "tests/services/correction/judged_plant.h"

#include <gtest/gtest.h>

#include <chrono>

#include "metrology/cloud/draco_codec.h"
#include "services/clients/scan_blocks.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/blobs.h"
#include "storage/calibrations.h"
#include "storage/plant_registry.h"
#include "storage/registrations.h"
#include "storage/scans.h"

namespace sixpoint::testing {
namespace {

constexpr double kDeg = 180 / 3.14159265358979323846;
constexpr char kPart[] = "parts/p1", kMachine[] = "machines/m1", kBlade[] = "blades/sn1";

grpc::Status NotFound(const std::string& name) { return {grpc::StatusCode::NOT_FOUND, name + " is not known"}; }

std::string IdOf(const std::string& name) { return name.substr(name.find('/') + 1); }

storage::RecordEntry Entry(const std::string& kind, const std::string& name) {
  storage::RecordEntry entry;
  entry.kind = kind;
  entry.name = name;
  entry.software_version = "test";
  return entry;
}

}  // namespace

grpc::Status StandInPlant::GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest* request,
                                      plant::v1::Machine* response) {
  if (request->name() != machine.name() || request->revision() != machine.revision()) return NotFound(request->name());
  *response = machine;
  return grpc::Status::OK;
}

grpc::Status StandInPlant::GetPart(grpc::ServerContext*, const plant::v1::GetPartRequest* request,
                                   plant::v1::Part* response) {
  if (request->name() != part.name() || request->revision() != part.revision()) return NotFound(request->name());
  *response = part;
  return grpc::Status::OK;
}

grpc::Status StandInPlant::DownloadSurface(grpc::ServerContext*, const plant::v1::DownloadSurfaceRequest*,
                                           grpc::ServerWriter<plant::v1::DownloadSurfaceResponse>* writer) {
  plant::v1::DownloadSurfaceResponse response;
  response.set_chunk(surface_bytes);
  writer->Write(response);
  return grpc::Status::OK;
}

grpc::Status StandInIngest::GetScan(grpc::ServerContext*, const ingest::v1::GetScanRequest* request,
                                    ingest::v1::Scan* response) {
  if (scans.count(request->name()) == 0) return NotFound(request->name());
  *response = scans.at(request->name());
  return grpc::Status::OK;
}

grpc::Status StandInIngest::DownloadScan(grpc::ServerContext*, const ingest::v1::DownloadScanRequest* request,
                                         grpc::ServerWriter<ingest::v1::DownloadScanResponse>* writer) {
  if (scans.count(request->name()) == 0) return NotFound(request->name());
  ingest::v1::DownloadScanResponse response;
  *response.mutable_scan() = scans.at(request->name());
  writer->Write(response);
  response.mutable_block()->set_point_count(static_cast<int>(scans.at(request->name()).header().point_count()));
  response.mutable_block()->set_payload(blocks.at(request->name()));
  writer->Write(response);
  return grpc::Status::OK;
}

grpc::Status StandInCalibration::GetCalibration(grpc::ServerContext*,
                                                const calibration::v1::GetCalibrationRequest* request,
                                                calibration::v1::Calibration* response) {
  if (request->name() == kSensorCalibration) *response = sensor;
  if (request->name() == kRotationCalibration) *response = rotation;
  for (const auto& [letter, axis] : axes)
    if (request->name() == axis.name()) *response = axis;
  return response->name().empty() ? NotFound(request->name()) : grpc::Status::OK;
}

grpc::Status StandInCalibration::GetCalibrationInForce(grpc::ServerContext*,
                                                       const calibration::v1::GetCalibrationInForceRequest* request,
                                                       calibration::v1::Calibration* response) {
  if (expired) return {grpc::StatusCode::FAILED_PRECONDITION, "machine: its calibration has expired"};
  if (request->kind() == calibration::v1::CALIBRATION_KIND_AXIS) {
    if (axes.count(request->axis()) == 0)
      return runtime::ToGrpc(
          runtime::Failure(errors::v1::CALIBRATION_MISSING, "axis: " + request->axis() + " is not characterised"));
    *response = axes.at(request->axis());
    return grpc::Status::OK;
  }
  *response = request->kind() == calibration::v1::CALIBRATION_KIND_SENSOR ? sensor : rotation;
  if (response->has_sensor() && !replacement.empty()) response->set_name(replacement);
  return grpc::Status::OK;
}

grpc::Status StandInRegistration::GetRegistration(grpc::ServerContext*,
                                                  const registration::v1::GetRegistrationRequest* request,
                                                  registration::v1::Registration* response) {
  if (request->name() != registration.name()) return NotFound(request->name());
  *response = registration;
  return grpc::Status::OK;
}

grpc::Status StandInRegistration::Register(grpc::ServerContext*, const registration::v1::RegisterRequest* request,
                                           registration::v1::Registration* response) {
  if (const auto one = refusal_by_method.find(request->method()); one != refusal_by_method.end() && !one->second.ok())
    return runtime::ToGrpc(one->second);
  if (!refusal.ok()) return runtime::ToGrpc(refusal);
  ++register_count;
  applied_axis_tables = request->apply_axis_tables();
  asked.push_back(*request);
  const auto other = by_method.find(request->method());
  *response = other == by_method.end() ? registration : other->second;
  response->set_method(request->method());
  *response->mutable_scans() = request->scans();
  return grpc::Status::OK;
}

void JudgedPlant::Withdraw(const std::string& name) {
  storage::CalibrationRow row;
  row.calibration_id = IdOf(name);
  row.machine_id = "m1";
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const auto withdrawn =
      storage::WithdrawCalibration(*transaction, row, {"sensor was knocked", "engineer", "test", {}});
  ASSERT_TRUE(withdrawn.ok()) << withdrawn.status();
  ASSERT_TRUE(transaction->Commit().ok());
}

JudgedPlant::JudgedPlant()
    : block(metrology::MakePinnedBlock()), server_({&plant, &ingest, &calibration, &registration}) {
  DescribePlant();
  DescribeCalibrations();
  DescribeRegistration();
  AddScans();
  StoreRows();
}

void JudgedPlant::DescribePlant() {
  plant.machine.set_name(kMachine);
  plant.machine.set_revision(1);
  for (const auto& [axis, direction] : {std::pair{"A", Eigen::Vector3d(Eigen::Vector3d::UnitY())},
                                        std::pair{"B", Eigen::Vector3d(Eigen::Vector3d::UnitX())}}) {
    plant::v1::Joint& joint = *plant.machine.mutable_kinematics()->add_part_side();
    joint.set_axis(axis);
    joint.set_kind(plant::v1::JOINT_KIND_ROTARY);
    runtime::ToProto(direction, joint.mutable_direction());
    runtime::ToProto(block.axes.a.point_mm, joint.mutable_point_mm());
    joint.set_sign(1);
    joint.set_minimum(-100);
    joint.set_maximum(100);
  }
  plant.part.set_name(kPart);
  plant.part.set_revision(1);
  runtime::ToProto(block.pose.zero_from_part, plant.part.mutable_zero_from_part_nominal());
  // The nominal part stands 0.3 mm lower than this one.
  plant.part.mutable_zero_from_part_nominal()->mutable_translation_mm()->set_z_mm(
      block.pose.zero_from_part.translation().z() - 0.3);
  plant::v1::HoleGroup& group = *plant.part.add_hole_groups();
  group.set_group("G1");
  group.set_diameter_mm(block.holes[0].pin.hole_diameter_mm);
  group.set_depth_mm(6);
  group.set_position_tolerance_mm(block.holes[0].position_tolerance_mm);
  group.set_inclination_tolerance_deg(block.holes[0].inclination_tolerance_rad * kDeg);
  runtime::ToProto(block.holes[0].pin.axis, group.mutable_axis_in_part());
  // Where the axis points along Z, to a degree.
  const Eigen::Vector3d v = block.pose.zero_from_part.linear() * block.holes[0].pin.axis;
  group.set_b_nominal_deg(std::round(std::atan2(v.y(), v.z()) * kDeg));
  group.set_a_nominal_deg(std::round(std::atan2(-v.x(), std::hypot(v.y(), v.z())) * kDeg));
  for (const metrology::InspectedHole& wanted : block.holes) {
    plant::v1::Hole& hole = *group.add_holes();
    hole.set_hole(wanted.name);
    runtime::ToProto(wanted.pin.start_mm, hole.mutable_start_in_part_mm());
    runtime::ToProto(wanted.pin.normal, hole.mutable_normal_in_part());
  }
  plant.surface_bytes = metrology::MeshBytes(metrology::BlockMesh());
  plant.part.mutable_surface()->set_surface_sha256(storage::Sha256Hex(plant.surface_bytes));
}

void JudgedPlant::DescribeCalibrations() {
  const std::int64_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  const auto common = [&](const char* name, calibration::v1::Calibration* out, std::int64_t lifetime_s) {
    out->set_name(name);
    out->set_machine(kMachine);
    out->mutable_valid_until()->set_seconds(now + lifetime_s);
  };
  common(kSensorCalibration, &calibration.sensor, 7200);
  common(kRotationCalibration, &calibration.rotation, 3600);
  calibration.sensor.set_kind(calibration::v1::CALIBRATION_KIND_SENSOR);
  calibration.rotation.set_kind(calibration::v1::CALIBRATION_KIND_ROTATION);
  calibration::v1::SensorCalibration& sensor = *calibration.sensor.mutable_sensor();
  for (int i = 0; i < 9; ++i) sensor.add_machine_from_sensor_rotation(block.sensor.rotation(i / 3, i % 3));
  runtime::ToProto(block.sensor.t_sm_mm, sensor.mutable_t_sm_mm());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(6, 6) * 1e-7;
  covariance.topLeftCorner(3, 3) *= 1e-3;
  runtime::MatrixToProto(covariance, sensor.mutable_covariance());
  calibration::v1::RotationCalibration& rotation = *calibration.rotation.mutable_rotation();
  runtime::ToProto(block.axes.a, rotation.mutable_a_axis());
  runtime::ToProto(block.axes.b, rotation.mutable_b_axis());
  runtime::MatrixToProto(Eigen::MatrixXd::Identity(8, 8) * 1e-10, rotation.mutable_covariance());
}

void JudgedPlant::DescribeRegistration() {
  registration::v1::Registration& out = registration.registration;
  out.set_name(kRegistration);
  out.set_blade(kBlade);
  out.set_machine(kMachine);
  out.set_machine_revision(1);
  out.set_part(kPart);
  out.set_part_revision(1);
  out.set_method(registration::v1::METHOD_SIX_POINT);
  out.set_sensor_calibration(kSensorCalibration);
  out.set_rotation_calibration(kRotationCalibration);
  runtime::ToProto(block.pose.zero_from_part, out.mutable_zero_from_part());
  metrology::PoseCovariance covariance;
  covariance.reference_mm = block.pose.zero_from_part.translation();
  covariance.values = metrology::Matrix6d::Identity() * 1e-8;
  covariance.values.topLeftCorner<3, 3>() *= 1e-3;
  runtime::ToProto(covariance, out.mutable_covariance());
  runtime::ToProto(covariance, out.mutable_noise_covariance());
  runtime::MatrixToProto(Eigen::MatrixXd::Zero(6, 14), out.mutable_calibration_sensitivity());
  out.mutable_evidence()->set_outcome(registration::v1::OUTCOME_CONVERGED);
}

void JudgedPlant::AddScans() {
  std::mt19937_64 random(11);
  for (const metrology::LineScan& scan : metrology::ScansOf(block, &random, 2000)) {
    const std::string id = "s" + std::to_string(scans.size());
    ingest::v1::Scan record;
    record.set_name("scans/" + id);
    ingest::v1::ScanHeader& header = *record.mutable_header();
    header.set_scan_id(id);
    header.set_machine(kMachine);
    header.set_subject(kBlade);
    header.set_kind(ingest::v1::SCAN_KIND_PINS);
    runtime::ToProto(scan.v0_mm, header.mutable_v0_mm());
    header.set_a_deg(scan.a_rad * kDeg);
    header.set_b_deg(scan.b_rad * kDeg);
    header.set_profile_pitch_mm(0.1);
    header.set_point_count(static_cast<std::int64_t>(scan.points_mm.size()));
    header.set_encoding(ingest::v1::ENCODING_DRACO);
    record.set_block_count(1);
    record.set_profile_count(1);
    const auto encoded = metrology::EncodeBlock(scan.points_mm, metrology::kDefaultErrorBoundMm);
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    clients::PayloadsDigest digest;
    digest.Add(encoded->bytes);
    record.set_sha256(digest.ToHex());
    ingest.blocks[record.name()] = encoded->bytes;
    ingest.scans[record.name()] = record;
    scans.push_back(record.name());
  }
}

void JudgedPlant::Characterise(bool is_b, const std::vector<double>& forward_error_deg,
                               const std::vector<double>& backward_error_deg, double standard_uncertainty_deg) {
  const std::string name = is_b ? kBCharacterisation : kACharacterisation;
  const std::string letter = plant.machine.kinematics().part_side(is_b ? 1 : 0).axis();
  calibration::v1::Calibration& out = calibration.axes[letter];
  const bool is_new = out.name().empty();
  out.set_name(name);
  out.set_machine(kMachine);
  out.set_kind(calibration::v1::CALIBRATION_KIND_AXIS);
  *out.mutable_valid_until() = calibration.sensor.valid_until();
  calibration::v1::AxisCharacterisation& axis = *out.mutable_axis();
  axis.set_axis(letter);
  axis.mutable_compensated_standard_uncertainty()->set_value_deg(standard_uncertainty_deg);
  axis.mutable_table()->set_step_deg(360.0 / static_cast<double>(forward_error_deg.size()));
  axis.mutable_table()->mutable_forward_error_deg()->Assign(forward_error_deg.begin(), forward_error_deg.end());
  axis.mutable_table()->mutable_backward_error_deg()->Assign(backward_error_deg.begin(), backward_error_deg.end());
  if (!is_new) return;
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const auto request = storage::PutBlob(*transaction, "encoder run");
  ASSERT_TRUE(request.ok()) << request.status();
  const auto recorded = storage::AppendRecord(*transaction, Entry("calibration", name));
  ASSERT_TRUE(recorded.ok()) << recorded.status();
  const auto stored = transaction->Execute(
      "INSERT INTO calibrations (calibration_id, machine_id, kind, axis, method, inputs, request_sha256, valid_from, "
      "valid_until, requested_by, software_version, record_sequence, recorded_at) "
      "VALUES ($1, 'm1', 'axis', $2, 'ENCODER_RUN', '{}', $3, '2020-01-01', '2100-01-01', '', 'test', $4, $5)",
      storage::Params()
          .Text(IdOf(name))
          .Text(letter)
          .Text(*request)
          .Int(recorded->sequence)
          .Time(recorded->recorded_at));
  ASSERT_TRUE(stored.ok()) << stored.status();
  ASSERT_TRUE(transaction->Commit().ok());
}

// Only what foreign keys ask for; the values themselves come from the stand-ins.
void JudgedPlant::StoreRows() {
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  storage::MachineRow machine;
  machine.machine_id = "m1";
  machine.content_sha256 = std::string(64, '0');
  machine.sensor_model = "model";
  machine.sensor_noise_um = 2;
  machine.sensor_column_count = 1280;
  machine.sensor_mid_range_mm = 66;
  machine.sensor_range_mm = 25;
  machine.sensor_line_angle_deg = 20;
  machine.nominal_centre_mm = {0, 0, 0};
  machine.safety_translation_mm = 2;
  machine.safety_rotation_deg = 3;
  const auto stored_machine = storage::InsertMachine(*transaction, machine, Entry("machine", ""));
  ASSERT_TRUE(stored_machine.ok()) << stored_machine.status();

  const auto blob = storage::PutBlob(*transaction, plant.surface_bytes);
  ASSERT_TRUE(blob.ok()) << blob.status();
  storage::PartRow part;
  part.part_id = "p1";
  part.content_sha256 = std::string(64, '0');
  part.cad_format = "stl";
  part.cad_unit_mm = 1;
  part.zero_from_part_nominal_rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  part.zero_from_part_nominal_translation_mm = {0, 0, 0};
  part.tessellation = {*blob, "stl", *blob, 12, 0, true, {-15, -15, -10}, {15, 15, 0}};
  const absl::Status tessellation = storage::InsertTessellation(*transaction, part.tessellation, "test");
  ASSERT_TRUE(tessellation.ok()) << tessellation;
  const auto stored_part = storage::InsertPart(*transaction, part, Entry("part", ""));
  ASSERT_TRUE(stored_part.ok()) << stored_part.status();
  const auto stored_blade = storage::InsertBlade(*transaction, {"sn1", "p1", {}}, Entry("blade", ""));
  ASSERT_TRUE(stored_blade.ok()) << stored_blade.status();

  for (const std::string& name : scans) {
    storage::ScanRow scan;
    scan.scan_id = IdOf(name);
    scan.machine_id = "m1";
    scan.machine_revision = 1;
    scan.blade_serial = "sn1";
    scan.kind = "pins";
    scan.profile_pitch_mm = 0.1;
    scan.columns_per_profile = 1280;
    scan.point_count = 1;
    scan.encoding = "draco";
    scan.block_count = 1;
    scan.profile_count = 1;
    scan.stored_encoding = "draco";
    scan.stored_bytes = 1;
    scan.stored_sha256 = scan.sent_sha256 = std::string(64, '0');
    const auto stored = storage::InsertScan(*transaction, scan, {}, Entry("scan", name));
    ASSERT_TRUE(stored.ok()) << stored.status();
  }
  // Their results are the calibration service's own; foreign keys end at the head row.
  for (const auto& [name, kind, method] :
       {std::tuple{kSensorCalibration, "sensor", "JOINT"}, std::tuple{kRotationCalibration, "rotation", "LINES"}}) {
    const auto recorded = storage::AppendRecord(*transaction, Entry("calibration", name));
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    const auto stored = transaction->Execute(
        "INSERT INTO calibrations (calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, "
        "valid_until, requested_by, software_version, record_sequence, recorded_at) "
        "VALUES ($1, 'm1', $2, $3, '{}', $4, '2020-01-01', '2100-01-01', '', 'test', $5, $6)",
        storage::Params()
            .Text(IdOf(name))
            .Text(kind)
            .Text(method)
            .Text(*blob)
            .Int(recorded->sequence)
            .Time(recorded->recorded_at));
    ASSERT_TRUE(stored.ok()) << stored.status();
  }
  storage::RegistrationRow row;
  row.registration_id = IdOf(kRegistration);
  row.blade_serial = "sn1";
  row.machine_id = "m1";
  row.machine_revision = 1;
  row.part_id = "p1";
  row.part_revision = 1;
  row.method = "SIX_POINT";
  row.sensor_calibration_id = IdOf(kSensorCalibration);
  row.rotation_calibration_id = IdOf(kRotationCalibration);
  row.outcome = "NOT_CONVERGED";  // without values: the stand-in tells them
  row.weakest_direction = std::vector<double>(6, 0.4);
  row.software_version = "test";
  const auto stored = storage::InsertRegistration(*transaction, row, Entry("registration", kRegistration));
  ASSERT_TRUE(stored.ok()) << stored.status();
  ASSERT_TRUE(transaction->Commit().ok());
}

}  // namespace sixpoint::testing
