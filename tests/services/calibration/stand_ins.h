// A plant and an ingest that are stood in for, and requests that a calibration can be made of. No database: handlers on a fake
// store need nothing else.
#pragma once

#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <string>

#include "metrology/cloud/draco_codec.h"
#include "metrology/kinematics/rotary_axes.h"
#include "services/clients/scan_blocks.h"
#include "services/runtime/geometry_proto.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "tests/metrology/calibration/artefact_sampler.h"

namespace sixpoint::calibration {

using sixpoint::testing::ArtefactBench;
inline constexpr double kDeg = M_PI / 180;

class FakePlant final : public plant::v1::PlantService::Service {
 public:
  explicit FakePlant(const ArtefactBench& bench) : artefact(bench.artefact), bench_(bench) {}
  metrology::Artefact artefact;  // as recorded
  // What is stated beside.
  std::optional<plant::v1::Certificate> certificate, touch_probe_certificate;
  std::optional<double> centre_standard_uncertainty_um, interim_check_limit_um, scanner_field_um;
  plant::v1::SensorKind sensor_kind = plant::v1::SENSOR_KIND_UNSPECIFIED;
  grpc::Status GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest* request,
                          plant::v1::Machine* out) override {
    if (request->name() == "machines/m2") return TiltRotaryTable(out);
    if (request->name() != "machines/m1") return {grpc::StatusCode::NOT_FOUND, "no such machine"};
    out->set_name("machines/m1");
    out->set_revision(3);
    out->mutable_sensor()->set_mid_range_mm(bench_.optics.mid_range_mm);
    out->mutable_sensor()->set_noise_um(2);
    out->mutable_sensor()->set_kind(sensor_kind);
    out->mutable_sensor()->set_range_mm(25);
    out->mutable_sensor()->set_line_angle_deg(20);
    if (interim_check_limit_um) out->mutable_safety_envelope()->set_interim_check_limit_um(*interim_check_limit_um);
    if (scanner_field_um) out->mutable_error_sources()->set_scanner_field_um(*scanner_field_um);
    if (touch_probe_certificate) *out->mutable_touch_probe()->mutable_certificate() = *touch_probe_certificate;
    runtime::ToProto(Eigen::Vector3d(26.6352, 54.8952, -193.32), out->mutable_nominal_centre_mm());
    for (const std::string axis : {"A", "B"}) {
      plant::v1::Joint* joint = out->mutable_kinematics()->add_part_side();
      joint->set_axis(axis);
      joint->set_kind(plant::v1::JOINT_KIND_ROTARY);
      joint->set_sign(1);
      (axis == "A") ? joint->mutable_direction()->set_y(1) : joint->mutable_direction()->set_x(1);
    }
    return grpc::Status::OK;
  }
  grpc::Status GetArtefact(grpc::ServerContext*, const plant::v1::GetArtefactRequest* request,
                           plant::v1::Artefact* out) override {
    if (request->name() != "artefacts/a1") return {grpc::StatusCode::NOT_FOUND, "no such artefact"};
    out->set_name("artefacts/a1");
    out->set_revision(2);
    out->set_side_mm(artefact.side_mm);
    out->set_cone_half_angle_deg(45);
    out->set_cone_top_radius_mm(2);
    out->set_cone_bottom_radius_mm(0.5);
    out->set_slot_width_mm(2.4);
    out->set_slot_depth_mm(0.8);
    if (certificate) *out->mutable_certificate() = *certificate;
    if (centre_standard_uncertainty_um) out->set_centre_standard_uncertainty_um(*centre_standard_uncertainty_um);
    for (const auto* features : {&artefact.cones, &artefact.slots})
      for (const metrology::PlaneFeature& f : *features) {
        plant::v1::NamedPlanePoint* p = features == &artefact.cones ? out->add_cones() : out->add_slots();
        p->set_feature(f.name);
        p->set_x_mm(f.centre_mm.x());
        p->set_y_mm(f.centre_mm.y());
      }
    return grpc::Status::OK;
  }

 private:
  // B about Y carries C about Z.
  static grpc::Status TiltRotaryTable(plant::v1::Machine* out) {
    out->set_name("machines/m2");
    out->set_revision(1);
    out->mutable_nominal_centre_mm()->set_z_mm(-120);
    for (const std::string axis : {"B", "C"}) {
      plant::v1::Joint* joint = out->mutable_kinematics()->add_part_side();
      joint->set_axis(axis);
      joint->set_kind(plant::v1::JOINT_KIND_ROTARY);
      joint->set_sign(1);
      joint->set_minimum(axis == "B" ? -110 : -360);
      joint->set_maximum(axis == "B" ? 110 : 360);
      (axis == "B") ? joint->mutable_direction()->set_y(1) : joint->mutable_direction()->set_z(1);
    }
    return grpc::Status::OK;
  }

  ArtefactBench bench_;
};

class FakeIngest final : public ingest::v1::ScanService::Service {
 public:
  grpc::Status DownloadScan(grpc::ServerContext*, const ingest::v1::DownloadScanRequest* request,
                            grpc::ServerWriter<ingest::v1::DownloadScanResponse>* writer) override {
    const auto scan = scans.find(request->name());
    if (scan == scans.end()) return {grpc::StatusCode::NOT_FOUND, "no such scan"};
    ingest::v1::DownloadScanResponse response;
    ingest::v1::Scan* record = response.mutable_scan();
    record->set_name(request->name());
    record->mutable_header()->set_scan_id(scan->second.id);
    record->mutable_header()->set_machine(machine);
    record->mutable_header()->set_subject(subject);
    record->mutable_header()->set_kind(kind);
    record->mutable_header()->set_point_count(static_cast<std::int64_t>(scan->second.points_mm.size()));
    runtime::ToProto(scan->second.v0_mm, record->mutable_header()->mutable_v0_mm());
    const auto block = metrology::EncodeBlock(scan->second.points_mm, metrology::kDefaultErrorBoundMm);
    clients::PayloadsDigest digest;
    digest.Add(block->bytes);
    record->set_sha256(digest.ToHex());
    record->set_profile_count(1);
    record->mutable_received_at()->set_seconds(received_s);
    record->mutable_header()->set_sensor_serial_number(sensor_serial_number);
    record->mutable_header()->set_travel(travel);
    record->mutable_header()->set_clamping(clamping);
    if (const auto series = arm_series.find(request->name()); series != arm_series.end())
      record->mutable_header()->set_arm_series(series->second);
    writer->Write(response);
    response.mutable_block()->set_point_count(static_cast<int>(scan->second.points_mm.size()));
    response.mutable_block()->set_payload(block->bytes);
    writer->Write(response);
    return grpc::Status::OK;
  }
  std::map<std::string, metrology::LineScan> scans;
  std::string machine = "machines/m1", subject = "artefacts/a1";
  ingest::v1::ScanKind kind = ingest::v1::SCAN_KIND_ARTEFACT;
  std::int64_t received_s = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now()) - 600;
  std::string sensor_serial_number, clamping;
  std::map<std::string, std::string> arm_series;  // by scan
  ingest::v1::ScanTravel travel = ingest::v1::SCAN_TRAVEL_UNSPECIFIED;
};

// 18 poses that axes through one point explain, some held out.
inline v1::CalibrateRotationRequest RotationRequest() {
  metrology::RotaryAxes axes;
  axes.a.point_mm = {26.63, 54.88, -193.322};
  axes.b.point_mm = {26.63, 54.871, -193.324};
  v1::CalibrateRotationRequest request;
  request.set_machine("machines/m1");
  for (int a = -60; a <= 60; a += 60)
    for (int b = 0; b < 360; b += 60) {
      v1::SpherePose* pose = request.add_poses();
      pose->set_a_deg(a);
      pose->set_b_deg(b);
      pose->set_held_out(request.poses_size() % 5 == 0);
      runtime::ToProto(Eigen::Vector3d(axes.MachineFromZero(a * kDeg, b * kDeg) * Eigen::Vector3d(52, 59, -128)),
                       pose->mutable_centre_mm());
    }
  request.set_standard_uncertainty_um(1);
  return request;
}

// Reversal `reversal_deg`, a long wave of 0.012 deg, 40 periods of 0.003 deg a turn.
inline v1::CharacteriseAxisRequest AxisRequest(const std::string& axis, double reversal_deg = 0.015,
                                               double noise_deg = 0, unsigned seed = 1) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 1);
  v1::CharacteriseAxisRequest request;
  request.set_machine("machines/m1");
  request.set_axis(axis);
  for (const int way : {1, -1})
    for (int i = 0; i <= 380; ++i) {
      const double commanded = way > 0 ? i - 10 : 370 - i;
      request.mutable_run()->add_commanded_deg(commanded);
      request.mutable_run()->add_measured_deg(commanded + 0.012 * std::sin(commanded * kDeg) +
                                              0.003 * std::cos(40 * commanded * kDeg) + way * reversal_deg / 2 +
                                              noise_deg * noise(random));
    }
  return request;
}

}  // namespace sixpoint::calibration
