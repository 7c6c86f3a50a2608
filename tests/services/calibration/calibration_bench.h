// The calibration service over real gRPC on a real PostgreSQL, between a plant and an ingest that are stood in for.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "metrology/cloud/draco_codec.h"
#include "services/calibration/calibration_service.h"
#include "services/clients/calibrations.h"
#include "services/clients/scan_blocks.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/calibrations.h"
#include "storage/scans.h"
#include "tests/metrology/calibration/artefact_sampler.h"
#include "tests/support/in_process_server.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::calibration {

using sixpoint::testing::ArtefactBench;
inline constexpr double kDeg = M_PI / 180;

class FakePlant final : public plant::v1::PlantService::Service {
 public:
  explicit FakePlant(const ArtefactBench& bench) : artefact(bench.artefact), bench_(bench) {}
  metrology::Artefact artefact;  // as recorded
  grpc::Status GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest* request,
                          plant::v1::Machine* out) override {
    if (request->name() == "machines/m2") return TiltRotaryTable(out);
    if (request->name() != "machines/m1") return {grpc::StatusCode::NOT_FOUND, "no such machine"};
    out->set_name("machines/m1");
    out->set_revision(3);
    out->mutable_sensor()->set_mid_range_mm(bench_.optics.mid_range_mm);
    out->mutable_sensor()->set_noise_um(2);
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
    writer->Write(response);
    response.mutable_block()->set_point_count(static_cast<int>(scan->second.points_mm.size()));
    response.mutable_block()->set_payload(block->bytes);
    writer->Write(response);
    return grpc::Status::OK;
  }
  std::map<std::string, metrology::LineScan> scans;
  std::string machine = "machines/m1", subject = "artefacts/a1";
  ingest::v1::ScanKind kind = ingest::v1::SCAN_KIND_ARTEFACT;
};

class CalibrationBench : public ::testing::Test {
 protected:
  CalibrationBench()
      : bench_(ArtefactBench::Usual()),
        plant_(bench_),
        plant_server_({&plant_}),
        ingest_server_({&ingest_}),
        service_(storage::CalibrationsIn(database_.database()), plant_server_.Connect(), ingest_server_.Connect(), 2),
        server_({&service_}),
        stub_(v1::CalibrationService::NewStub(server_.Connect())),
        client_(server_.Connect()) {
    std::mt19937_64 random(4);
    Execute("INSERT INTO machines (machine_id) VALUES ('m1'), ('m2')");
    Execute("INSERT INTO artefacts (artefact_id) VALUES ('a1')");
    AddScan(bench_.Scan("high", 10, 2e-3, &random));
    AddScan(bench_.Scan("low", -10, 2e-3, &random));
    touch_ = bench_.Touch(bench_.touch_noise_mm, &random);
  }

  storage::Rows Execute(const std::string& sql) {
    auto transaction = database_.database()->Begin(testing::Soon());
    EXPECT_TRUE(transaction.ok()) << transaction.status();
    const auto rows = transaction->Execute(sql);
    EXPECT_TRUE(rows.ok()) << rows.status();
    EXPECT_TRUE(transaction->Commit().ok());
    return rows.ok() ? *rows : storage::Rows();
  }

  // To the stand-in, and its row, which the calibration's residuals refer to.
  void AddScan(const metrology::LineScan& scan) {
    ingest_.scans["scans/" + scan.id] = scan;
    storage::ScanRow row;
    row.scan_id = scan.id;
    row.machine_id = "m1";
    row.machine_revision = 3;
    row.artefact_id = "a1";
    row.artefact_revision = 2;
    row.kind = "artefact";
    row.profile_pitch_mm = 0.1;
    row.columns_per_profile = 320;
    row.point_count = static_cast<std::int64_t>(scan.points_mm.size());
    row.encoding = "draco";
    row.block_count = 1;
    row.profile_count = 1;
    row.stored_encoding = "draco";
    row.stored_bytes = 1;
    row.stored_sha256 = row.sent_sha256 = std::string(64, '0');
    storage::RecordEntry entry;
    entry.kind = "scan";
    entry.name = "scans/" + scan.id;
    entry.software_version = "test";
    auto transaction = database_.database()->Begin(testing::Soon());
    ASSERT_TRUE(transaction.ok()) << transaction.status();
    const auto recorded = storage::InsertScan(*transaction, row, {}, entry);
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }

  v1::CalibrateSensorRequest SensorRequest() const {
    v1::CalibrateSensorRequest request;
    request.set_machine("machines/m1");
    request.set_artefact("artefacts/a1");
    request.add_scans("scans/high");
    request.add_scans("scans/low");
    for (const metrology::TouchedPoint& t : touch_.centres) {
      v1::NamedPoint* centre = request.mutable_touch()->add_centres();
      centre->set_feature(t.name);
      runtime::ToProto(t.point_mm, centre->mutable_point_mm());
    }
    for (const auto& p : touch_.plane_mm) runtime::ToProto(p, request.mutable_touch()->add_plane_mm());
    for (const auto& p : touch_.side_x_mm) runtime::ToProto(p, request.mutable_touch()->add_side_x_mm());
    for (const auto& p : touch_.side_y_mm) runtime::ToProto(p, request.mutable_touch()->add_side_y_mm());
    request.set_requested_by("engineer");
    return request;
  }

  v1::CalibrateRotationRequest RotationRequest() const {
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
  static v1::CharacteriseAxisRequest AxisRequest(const std::string& axis, double reversal_deg = 0.015,
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

  v1::Calibration Characterise(const v1::CharacteriseAxisRequest& request) {
    v1::Calibration made;
    const grpc::Status status = Call(&v1::CalibrationService::Stub::CharacteriseAxis, request, &made);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return made;
  }

  template <typename Request, typename Response>
  grpc::Status Call(grpc::Status (v1::CalibrationService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                         Response*),
                    const Request& request, Response* response) {
    const auto context = runtime::ContextFor(60);
    return (stub_.get()->*method)(context.get(), request, response);
  }

  v1::Calibration StateOf(const std::string& name) {
    v1::GetCalibrationRequest get;
    get.set_name(name);
    v1::Calibration found;
    EXPECT_TRUE(Call(&v1::CalibrationService::Stub::GetCalibration, get, &found).ok());
    return found;
  }

  absl::StatusOr<v1::WithdrawCalibrationResponse> Withdraw(const v1::WithdrawCalibrationRequest& request) {
    v1::WithdrawCalibrationResponse response;
    const grpc::Status status = stub_->WithdrawCalibration(runtime::ContextFor(20).get(), request, &response);
    if (!status.ok()) return runtime::FromGrpc(status);
    return response;
  }

  ArtefactBench bench_;
  metrology::ArtefactTouch touch_;
  testing::ThrowawayDatabase database_;
  FakePlant plant_;
  FakeIngest ingest_;
  testing::InProcessServer plant_server_, ingest_server_;
  CalibrationService service_;
  testing::InProcessServer server_;
  std::unique_ptr<v1::CalibrationService::Stub> stub_;
  clients::CalibrationClient client_;
};

}  // namespace sixpoint::calibration
