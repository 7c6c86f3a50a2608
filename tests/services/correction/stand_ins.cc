#include "tests/services/correction/stand_ins.h"

#include <gtest/gtest.h>

#include <chrono>

#include "metrology/cloud/draco_codec.h"
#include "metrology/mesh/mesh_bytes.h"
#include "services/clients/scan_blocks.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/stored_geometry.h"
#include "storage/blobs.h"

namespace sixpoint::testing {
namespace {

constexpr double kDeg = 180 / 3.14159265358979323846;
constexpr char kPart[] = "parts/p1", kMachine[] = "machines/m1", kBlade[] = "blades/sn1";

grpc::Status NotFound(const std::string& name) { return {grpc::StatusCode::NOT_FOUND, name + " is not known"}; }

}  // namespace

grpc::Status StandInPlant::GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest* request,
                                      plant::v1::Machine* response) {
  if (request->name() != machine.name() + "@" + std::to_string(machine.revision())) return NotFound(request->name());
  *response = machine;
  return grpc::Status::OK;
}

grpc::Status StandInPlant::GetPart(grpc::ServerContext*, const plant::v1::GetPartRequest* request,
                                   plant::v1::Part* response) {
  if (request->name() != part.name() + "@" + std::to_string(part.revision())) return NotFound(request->name());
  *response = part;
  return grpc::Status::OK;
}

grpc::Status StandInPlant::GetMachiningModel(grpc::ServerContext*, const plant::v1::GetMachiningModelRequest* request,
                                             plant::v1::MachiningModel* response) {
  if (models.count(request->name()) == 0) return NotFound(request->name());
  *response = models.at(request->name());
  return grpc::Status::OK;
}

grpc::Status StandInDrawings::GetDrawing(grpc::ServerContext*, const plant::v1::GetDrawingRequest* request,
                                         plant::v1::Drawing* response) {
  if (drawings.count(request->name()) == 0) return NotFound(request->name());
  *response = drawings.at(request->name());
  return grpc::Status::OK;
}

grpc::Status StandInPlant::ListMachiningModels(grpc::ServerContext*,
                                               const plant::v1::ListMachiningModelsRequest* request,
                                               plant::v1::ListMachiningModelsResponse* response) {
  for (const auto& [name, model] : models)
    if (name.find('@') == std::string::npos && model.part() == request->part())
      *response->add_machining_models() = model;
  return grpc::Status::OK;
}

void StandInPlant::AddModel() {
  plant::v1::MachiningModel model;
  model.set_name("machining_models/edm");
  model.set_revision(1);
  model.set_part(part.name());
  plant::v1::MachiningOperation& operation = *model.add_operations();
  operation.set_operation("OP10");
  operation.set_hole_group(part.hole_groups(0).group());
  operation.mutable_electrode()->set_diameter_mm(part.hole_groups(0).diameter_mm());
  operation.mutable_electrode()->set_length_mm(40);
  operation.mutable_electrode()->set_wear_mm(1);
  model.set_nc_template("G90 G55\nG0 X1 Y2 Z3 A4 B5 (SIXPOINT G1/H2)\nX1 Y2 Z3 (SIXPOINT G1/H1)\n");
  plant::v1::WorkOffset& offset = *model.add_work_offsets();
  offset.set_code("G55");
  offset.set_x_mm(1.5);
  models["machining_models/edm"] = models["machining_models/edm@1"] = model;
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
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++downloads_[request->name()];
  }
  if (grpc::Status there = Check(request->name()); !there.ok()) return there;
  ingest::v1::DownloadScanResponse response;
  *response.mutable_scan() = scans.at(request->name());
  writer->Write(response);
  response.mutable_block()->set_point_count(static_cast<int>(scans.at(request->name()).header().point_count()));
  response.mutable_block()->set_payload(blocks.at(request->name()));
  writer->Write(response);
  return grpc::Status::OK;
}

grpc::Status StandInIngest::ListScanBlocks(grpc::ServerContext*, const ingest::v1::ListScanBlocksRequest* request,
                                           ingest::v1::ListScanBlocksResponse* response) {
  if (grpc::Status there = Check(request->name()); !there.ok()) return there;
  response->add_blocks()->set_point_count(static_cast<int>(scans.at(request->name()).header().point_count()));
  return grpc::Status::OK;
}

grpc::Status StandInIngest::Check(const std::string& name) const {
  if (scans.count(name) == 0) return NotFound(name);
  if (deleted.count(name) == 0) return grpc::Status::OK;
  return runtime::ToGrpc(runtime::Failure(errors::v1::POINTS_DELETED, name + ": its points were deleted"));
}

std::map<std::string, int> StandInIngest::downloads() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return downloads_;
}

grpc::Status StandInCalibration::GetCalibration(grpc::ServerContext*,
                                                const calibration::v1::GetCalibrationRequest* request,
                                                calibration::v1::Calibration* response) {
  if (request->name() == kSensorCalibration) *response = sensor;
  if (request->name() == kRotationCalibration) *response = rotation;
  if (remounted && request->name() == remounted->name()) *response = *remounted;
  for (const auto& [letter, axis] : axes)
    if (request->name() == axis.name()) *response = axis;
  return response->name().empty() ? NotFound(request->name()) : grpc::Status::OK;
}

grpc::Status StandInCalibration::GetCalibrationInForce(grpc::ServerContext*,
                                                       const calibration::v1::GetCalibrationInForceRequest* request,
                                                       calibration::v1::Calibration* response) {
  if (expired) return {grpc::StatusCode::FAILED_PRECONDITION, "machine: its calibration has expired"};
  if (request->kind() == calibration::v1::CALIBRATION_KIND_AXIS) {
    if (axes.count(request->axis()) > 0 && axes_over)
      return runtime::ToGrpc(runtime::Failure(errors::v1::CALIBRATION_EXPIRED, "axis: its characterisation is over"));
    if (axes.count(request->axis()) == 0)
      return runtime::ToGrpc(
          runtime::Failure(errors::v1::CALIBRATION_MISSING, "axis: " + request->axis() + " is not characterised"));
    *response = axes.at(request->axis());
    return grpc::Status::OK;
  }
  *response = request->kind() == calibration::v1::CALIBRATION_KIND_SENSOR ? sensor : rotation;
  if (request->has_at() && response->has_sensor() && request->at().seconds() < in_force_from_s)
    return runtime::ToGrpc(
        runtime::Failure(errors::v1::CALIBRATION_MISSING, "machine: it had no sensor calibration then"));
  if (response->has_sensor() && remounted && (!request->has_at() || request->at().seconds() >= remounted_s))
    *response = *remounted;
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

grpc::Status StandInRegistration::ListRegistrations(grpc::ServerContext*,
                                                    const registration::v1::ListRegistrationsRequest* request,
                                                    registration::v1::ListRegistrationsResponse* response) {
  for (const registration::v1::Registration& one : later)
    if ((request->blade().empty() || one.blade() == request->blade()) &&
        (request->machine().empty() || one.machine() == request->machine()))
      *response->add_registrations() = one;
  return grpc::Status::OK;
}

grpc::Status StandInStudies::ListStudies(grpc::ServerContext*, const calibration::v1::ListStudiesRequest* request,
                                         calibration::v1::ListStudiesResponse* response) {
  if (interim_check.has_value() && request->kind() == calibration::v1::STUDY_KIND_INTERIM_CHECK &&
      request->verdict() == interim_check->verdict() &&
      request->sensor_calibration() == interim_check->interim_check().sensor_calibration() &&
      request->clamping() == interim_check->interim_check().clamping())
    *response->add_studies() = *interim_check;
  if (arm.has_value() && request->kind() == calibration::v1::STUDY_KIND_ARM) *response->add_studies() = *arm;
  return grpc::Status::OK;
}

grpc::Status StandInRegistration::ReplayRegistration(grpc::ServerContext*,
                                                     const registration::v1::ReplayRegistrationRequest* request,
                                                     replay::v1::Replay* response) {
  response->set_name(request->name());
  response->set_outcome(replay::v1::REPLAY_OUTCOME_SAME_BITS);
  return grpc::Status::OK;
}

StandIns::StandIns()
    : block(metrology::MakePinnedBlock()),
      server_({&plant, &drawings, &ingest, &calibration, &studies, &registration}) {
  DescribePlant();
  DescribeCalibrations();
  DescribeRegistration();
  AddScans();
}

void StandIns::DescribePlant() {
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
    joint.set_positioning_standard_uncertainty_deg(1e-5);
  }
  plant::v1::SafetyEnvelope& envelope = *plant.machine.mutable_safety_envelope();
  envelope.set_translation_mm(2);
  envelope.set_rotation_deg(3);
  envelope.set_uncertainty_share(1);
  envelope.set_registration_age_h(8);
  envelope.set_keep_out_mm(0);  // the tests' templates go straight from hole to hole
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
  group.set_position_zone(plant::v1::POSITION_ZONE_RADIUS);
  group.mutable_gauge_pin()->set_diameter_mm(2 * block.pins[0].radius_mm);
  group.mutable_gauge_pin()->set_diameter_standard_uncertainty_um(0.5);
  group.mutable_gauge_pin()->set_greatest_play_mm(0);
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

void StandIns::DescribeCalibrations() {
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
  runtime::SetMatrix(runtime::RowMajor(covariance), 6, 6, sensor.mutable_covariance());
  calibration::v1::RotationCalibration& rotation = *calibration.rotation.mutable_rotation();
  runtime::ToProto(block.axes.a, rotation.mutable_a_axis());
  runtime::ToProto(block.axes.b, rotation.mutable_b_axis());
  runtime::SetMatrix(runtime::RowMajor(Eigen::MatrixXd::Identity(8, 8) * 1e-10), 8, 8, rotation.mutable_covariance());
}

void StandIns::DescribeRegistration() {
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
  metrology::PoseCovariance covariance(metrology::Matrix6d::Identity() * 1e-8, block.pose.zero_from_part.translation());
  covariance.values.topLeftCorner<3, 3>() *= 1e-3;
  runtime::ToProto(covariance, out.mutable_covariance());
  runtime::ToProto(covariance, out.mutable_noise_covariance());
  runtime::SetMatrix(std::vector<double>(6 * metrology::kCalibratedParameterCount), 6,
                     metrology::kCalibratedParameterCount, out.mutable_calibration_sensitivity());
  out.set_record_sequence(1);
  out.mutable_recorded_at()->set_seconds(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now()) - 60);
  // Nothing that a gate would stop.
  registration::v1::Evidence& evidence = *out.mutable_evidence();
  evidence.set_outcome(registration::v1::OUTCOME_CONVERGED);
  evidence.set_condition_number(5);
  evidence.set_information_kept(0.9);
  evidence.mutable_disagreement()->set_ratio(1);
  evidence.mutable_merge()->set_freedom(3);
  evidence.mutable_merge()->set_chi_squared(2);
  evidence.mutable_merge()->set_limit(16.3);
}

void StandIns::AddScans() {
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

bool StandIns::Characterise(bool is_b, const std::vector<double>& forward_error_deg,
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
  return is_new;
}

}  // namespace sixpoint::testing
