// The service over real gRPC on a real PostgreSQL, between a plant and an ingest that are stood in for.
#include "services/calibration/calibration_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "metrology/cloud/draco_codec.h"
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
namespace {

using sixpoint::testing::ArtefactBench;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
constexpr double kDeg = M_PI / 180;

class FakePlant final : public plant::v1::PlantService::Service {
 public:
  explicit FakePlant(const ArtefactBench& bench) : bench_(bench) {}
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
    out->set_side_mm(bench_.artefact.side_mm);
    out->set_cone_half_angle_deg(45);
    out->set_cone_top_radius_mm(2);
    out->set_cone_bottom_radius_mm(0.5);
    out->set_slot_width_mm(2.4);
    out->set_slot_depth_mm(0.8);
    for (const auto* features : {&bench_.artefact.cones, &bench_.artefact.slots})
      for (const metrology::PlaneFeature& f : *features) {
        plant::v1::NamedPlanePoint* p = features == &bench_.artefact.cones ? out->add_cones() : out->add_slots();
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
    record->mutable_header()->set_machine("machines/m1");
    record->mutable_header()->set_subject("artefacts/a1");
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
};

class CalibrationServiceTest : public ::testing::Test {
 protected:
  CalibrationServiceTest()
      : bench_(ArtefactBench::Usual()),
        plant_(bench_),
        plant_server_({&plant_}),
        ingest_server_({&ingest_}),
        service_(database_.database(), plant_server_.Connect(), ingest_server_.Connect(), 2),
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

  static v1::CharacteriseAxisRequest AxisRequest(const std::string& axis) {
    v1::CharacteriseAxisRequest request;
    request.set_machine("machines/m1");
    request.set_axis(axis);
    for (const int way : {1, -1})
      for (int i = 0; i <= 380; ++i) {
        const double commanded = way > 0 ? i - 10 : 370 - i;
        request.mutable_run()->add_commanded_deg(commanded);
        request.mutable_run()->add_measured_deg(commanded + 0.012 * std::sin(commanded * kDeg) +
                                                0.003 * std::cos(40 * commanded * kDeg) + way * 0.0075);
      }
    return request;
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

TEST_F(CalibrationServiceTest, SensorCalibrationIsStoredWholeAndFetchedToTheSameBits) {
  v1::Calibration made;
  const grpc::Status status = Call(&v1::CalibrationService::Stub::CalibrateSensor, SensorRequest(), &made);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(made.method(), "JOINT");
  EXPECT_THAT(made.inputs(), ElementsAre("machines/m1@3", "artefacts/a1@2", "scans/high", "scans/low"));
  EXPECT_EQ(made.sensor().fitted_size(), 6);
  EXPECT_EQ(made.sensor().check_size(), 6);
  EXPECT_GT(made.record_sequence(), 0);

  v1::GetCalibrationRequest get;
  get.set_name(made.name());
  v1::Calibration found;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::GetCalibration, get, &found).ok());
  EXPECT_EQ(found.SerializeAsString(), made.SerializeAsString());

  const auto in_force = client_.SensorInForce("machines/m1", runtime::ContextFor(10));
  ASSERT_TRUE(in_force.ok()) << in_force.status();
  EXPECT_EQ(in_force->name, made.name());
  EXPECT_EQ(in_force->sensor.t_sm_mm.x(), made.sensor().t_sm_mm().x_mm());
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(in_force->sensor.t_sm_mm(k), bench_.sensor.t_sm_mm(k),
                4 * std::sqrt(in_force->sensor.covariance(3 + k, 3 + k)));
  // Recall reaches it from the scan.
  auto transaction = database_.database()->Begin(testing::Soon());
  ASSERT_TRUE(transaction.ok());
  const auto derived = storage::DerivedFrom(*transaction, "scans/high");
  ASSERT_TRUE(derived.ok());
  ASSERT_EQ(derived->size(), 1u);
  EXPECT_EQ(derived->front().entry.name, made.name());
}

TEST_F(CalibrationServiceTest, TheSameRequestIdIsOneCalibration) {
  v1::CalibrateRotationRequest request = RotationRequest();
  request.set_request_id(storage::NewUuid());
  v1::Calibration first, second;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &first).ok());
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &second).ok());
  EXPECT_EQ(first.SerializeAsString(), second.SerializeAsString());
  EXPECT_EQ(Execute("SELECT count(*) FROM calibrations").Int(0, 0), 1);
  request.set_standard_uncertainty_um(2);
  EXPECT_EQ(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &second).error_code(),
            grpc::StatusCode::ALREADY_EXISTS);
}

TEST_F(CalibrationServiceTest, TheNewestValidOneIsInForce) {
  const auto missing = client_.RotationInForce("machines/m1", runtime::ContextFor(10));
  EXPECT_EQ(missing.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(runtime::ReasonOf(missing.status()), "CALIBRATION_MISSING");

  v1::CalibrateRotationRequest request = RotationRequest();
  v1::Calibration old, newer, past;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &old).ok());
  request.set_method(v1::ROTATION_METHOD_POINT_C);
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &newer).ok());
  request.mutable_valid_from()->set_seconds(1'700'000'000);
  request.mutable_valid_until()->set_seconds(1'700'000'100);
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &past).ok());
  const auto in_force = client_.RotationInForce("machines/m1", runtime::ContextFor(10));
  ASSERT_TRUE(in_force.ok()) << in_force.status();
  EXPECT_EQ(in_force->name, newer.name());

  v1::GetCalibrationInForceRequest at;
  at.set_machine("machines/m1");
  at.set_kind(v1::CALIBRATION_KIND_ROTATION);
  at.mutable_at()->set_seconds(1'700'000'099);
  v1::Calibration found;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::GetCalibrationInForce, at, &found).ok());
  EXPECT_EQ(found.name(), past.name());
  at.mutable_at()->set_seconds(1'700'000'100);  // the first moment at which it is no longer valid
  const grpc::Status expired = Call(&v1::CalibrationService::Stub::GetCalibrationInForce, at, &found);
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(expired)), "CALIBRATION_EXPIRED");
  // Of the wrong kind.
  EXPECT_EQ(client_.Sensor(newer.name(), runtime::ContextFor(10)).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(CalibrationServiceTest, ListsNewestFirstPageByPage) {
  std::vector<std::string> names;
  for (int i = 0; i < 5; ++i) {
    v1::Calibration made;
    ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &made).ok());
    names.insert(names.begin(), made.name());
  }
  std::vector<std::string> listed;
  v1::ListCalibrationsRequest request;
  request.set_machine("machines/m1");
  request.set_kind(v1::CALIBRATION_KIND_ROTATION);
  request.set_page_size(2);
  int pages = 0;
  do {
    v1::ListCalibrationsResponse page;
    const auto context = runtime::ContextFor(10);
    ASSERT_TRUE(stub_->ListCalibrations(context.get(), request, &page).ok());
    for (const v1::Calibration& c : page.calibrations()) listed.push_back(c.name());
    request.set_page_token(page.next_page_token());
    ++pages;
  } while (!request.page_token().empty());
  EXPECT_EQ(listed, names);
  EXPECT_EQ(pages, 3);
}

TEST_F(CalibrationServiceTest, AnAxisIsCharacterisedStoredAndFoundAgain) {
  v1::CharacteriseAxisRequest request = AxisRequest("A");
  request.set_request_id(storage::NewUuid());
  v1::AxisCharacterisation made, again, found;
  const grpc::Status status = Call(&v1::CalibrationService::Stub::CharacteriseAxis, request, &made);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_NEAR(made.reversal().value_deg(), 0.015, 1e-9);
  EXPECT_NEAR(made.periodic().period_deg(), 9, 1e-12);
  EXPECT_NEAR(made.periodic().amplitude().value_deg(), 0.003, 1e-9);
  EXPECT_NEAR(made.long_wave().amplitude().value_deg(), 0.012, 1e-9);
  EXPECT_THAT(made.inputs(), ElementsAre("machines/m1@3"));
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CharacteriseAxis, request, &again).ok());
  EXPECT_EQ(again.SerializeAsString(), made.SerializeAsString());
  v1::GetAxisCharacterisationRequest get;
  get.set_name(made.name());
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::GetAxisCharacterisation, get, &found).ok());
  EXPECT_EQ(found.SerializeAsString(), made.SerializeAsString());
  get.set_name("characterisations/" + storage::NewUuid());
  EXPECT_EQ(Call(&v1::CalibrationService::Stub::GetAxisCharacterisation, get, &found).error_code(),
            grpc::StatusCode::NOT_FOUND);
  // Newest first, of one axis.
  request = AxisRequest("A");
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CharacteriseAxis, request, &again).ok());
  request = AxisRequest("B");
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CharacteriseAxis, request, &found).ok());
  v1::ListAxisCharacterisationsRequest list;
  list.set_machine("machines/m1");
  list.set_axis("A");
  list.set_page_size(1);
  v1::ListAxisCharacterisationsResponse page;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ListAxisCharacterisations, list, &page).ok());
  ASSERT_EQ(page.characterisations_size(), 1);
  EXPECT_EQ(page.characterisations(0).name(), again.name());
  list.set_page_token(page.next_page_token());
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ListAxisCharacterisations, list, &page).ok());
  EXPECT_EQ(page.characterisations(0).SerializeAsString(), made.SerializeAsString());
  EXPECT_EQ(page.next_page_token(), "");
}

TEST_F(CalibrationServiceTest, RunsThatTellNothingAreRefused) {
  v1::AxisCharacterisation made;
  const auto refused = [&](const v1::CharacteriseAxisRequest& request) {
    const grpc::Status status = Call(&v1::CalibrationService::Stub::CharacteriseAxis, request, &made);
    return status.ok() ? "accepted" : status.error_message();
  };
  EXPECT_THAT(refused(AxisRequest("C")), HasSubstr("axis: C, want a rotary axis of machines/m1: A, B"));
  EXPECT_THAT(refused(AxisRequest("")), HasSubstr("axis: empty"));
  v1::CharacteriseAxisRequest request = AxisRequest("A");
  request.mutable_run()->set_measured_deg(5, INFINITY);
  EXPECT_THAT(refused(request), HasSubstr("run.measured_deg[5]"));
  request = AxisRequest("A");
  request.mutable_run()->mutable_measured_deg()->RemoveLast();
  EXPECT_THAT(refused(request), HasSubstr("one for each command"));
  request = AxisRequest("A");
  request.mutable_run()->mutable_measured_deg()->Truncate(200);
  request.mutable_run()->mutable_commanded_deg()->Truncate(200);
  EXPECT_THAT(refused(request), HasSubstr("want a whole turn both ways"));
  request = AxisRequest("A");
  for (double& measured : *request.mutable_run()->mutable_measured_deg()) measured *= kDeg;
  EXPECT_THAT(refused(request), HasSubstr("want within 1 deg of the command"));
  request = AxisRequest("A");
  request.set_machine("machines/m9");
  EXPECT_THAT(refused(request), HasSubstr("one that the plant knows"));
  EXPECT_EQ(Execute("SELECT count(*) FROM axis_characterisations").Int(0, 0), 0);
}

TEST_F(CalibrationServiceTest, AxisTablesAreAppliedWhereAsked) {
  v1::CalibrateRotationRequest request = RotationRequest();
  request.set_apply_axis_tables(true);
  v1::Calibration made, plain;
  const grpc::Status none = Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made);
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(none)), "AXIS_NOT_CHARACTERISED");
  v1::AxisCharacterisation axis;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CharacteriseAxis, AxisRequest("A"), &axis).ok());
  // The spheres stand where the axis brings them.
  metrology::RotaryAxes axes;
  axes.a.point_mm = {26.63, 54.88, -193.322};
  axes.b.point_mm = {26.63, 54.871, -193.324};
  for (v1::SpherePose& pose : *request.mutable_poses()) {
    const double a = pose.a_deg() + 0.012 * std::sin(pose.a_deg() * kDeg) + 0.003 * std::cos(40 * pose.a_deg() * kDeg);
    pose.set_a_travel(v1::TRAVEL_FORWARD);
    runtime::ToProto(
        Eigen::Vector3d(axes.MachineFromZero((a + 0.0075) * kDeg, pose.b_deg() * kDeg) * Eigen::Vector3d(52, 59, -128)),
        pose.mutable_centre_mm());
  }
  const grpc::Status status = Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_THAT(made.inputs(), ElementsAre("machines/m1@3", axis.name()));
  EXPECT_LT(made.rotation().check_rms_um(), 0.1);  // the table's interpolation
  request.set_apply_axis_tables(false);
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &plain).ok());
  EXPECT_GT(plain.rotation().check_rms_um(), 10 * made.rotation().check_rms_um());
  EXPECT_EQ(plain.inputs_size(), 1);
}

TEST_F(CalibrationServiceTest, CalibratesATiltRotaryTableByItsOwnLetters) {
  metrology::RotaryAxes axes{{Eigen::Vector3d::UnitY(), {0.02, 0, -120.03}},
                             {Eigen::Vector3d::UnitZ(), {0.01, -0.04, 0}}};
  v1::CalibrateRotationRequest request;
  request.set_machine("machines/m2");
  for (int b = -90; b <= 90; b += 45)
    for (int c = 0; c < 360; c += 60) {
      v1::SpherePose* pose = request.add_poses();
      pose->set_a_deg(b);
      pose->set_b_deg(c);
      runtime::ToProto(Eigen::Vector3d(axes.MachineFromZero(b * kDeg, c * kDeg) * Eigen::Vector3d(45, -20, 30)),
                       pose->mutable_centre_mm());
    }
  v1::Calibration made, found;
  grpc::Status status = Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_THAT(made.rotation().axes(), ElementsAre("B", "C"));
  EXPECT_LT(made.rotation().residual_rms_um(), 1e-3);
  // Both error curves: the record is some tens of um off.
  ASSERT_EQ(made.rotation().residuals_size(), 30);
  double before_um = 0;
  for (const v1::PoseResidual& pose : made.rotation().residuals()) before_um = std::max(before_um, pose.before_um());
  EXPECT_GT(before_um, 10);
  v1::GetCalibrationRequest get;
  get.set_name(made.name());
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::GetCalibration, get, &found).ok());
  EXPECT_EQ(found.SerializeAsString(), made.SerializeAsString());
  request.mutable_poses(3)->set_a_deg(110.5);
  status = Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made);
  EXPECT_EQ(status.error_message(), "poses[3].B: 110.5 deg, want -110 to 110 deg, the axis's limits");
}

TEST_F(CalibrationServiceTest, TheStandardProcedureIsAMethod) {
  const Eigen::Vector3d c(26.6182, 54.8481, -193.1247);
  v1::CalibrateRotationRequest request = RotationRequest();
  request.set_method(v1::ROTATION_METHOD_STANDARD);
  v1::Calibration made;
  EXPECT_THAT(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made).error_message(),
              HasSubstr("standard: empty, want bore and face"));
  for (int i = 0; i < 8; ++i) {
    const double at = i * M_PI / 4;
    runtime::ToProto(Eigen::Vector3d(c + Eigen::Vector3d(12 * std::cos(at), 12 * std::sin(at), -40)),
                     request.mutable_standard()->add_bore_mm());
    runtime::ToProto(Eigen::Vector3d(c + Eigen::Vector3d(5.0 * i, -3.0 * i, 75)),
                     request.mutable_standard()->add_face_mm());
  }
  request.mutable_standard()->set_face_above_centre_mm(75);
  const grpc::Status status = Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(made.method(), "STANDARD");
  EXPECT_NEAR(made.rotation().point_c_mm().x_mm(), c.x(), 1e-9);
  EXPECT_NEAR(made.rotation().point_c_mm().z_mm(), c.z(), 1e-9);
  EXPECT_EQ(made.rotation().check_count(), request.poses_size());
  EXPECT_TRUE(made.rotation().residuals(0).held_out());
}

TEST_F(CalibrationServiceTest, NothingIsStoredForARefusal) {
  v1::Calibration made;
  v1::CalibrateSensorRequest request = SensorRequest();
  for (v1::NamedPoint& c : *request.mutable_touch()->mutable_centres()) {
    c.mutable_point_mm()->set_x_mm(c.point_mm().x_mm() * 25.4);
    c.mutable_point_mm()->set_y_mm(c.point_mm().y_mm() * 25.4);
    c.mutable_point_mm()->set_z_mm(c.point_mm().z_mm() * 25.4);
  }
  grpc::Status status = Call(&v1::CalibrationService::Stub::CalibrateSensor, request, &made);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("send millimetres"));
  request = SensorRequest();
  request.mutable_scans()->RemoveLast();
  status = Call(&v1::CalibrationService::Stub::CalibrateSensor, request, &made);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(status)), "CALIBRATION_UNDETERMINED");
  EXPECT_THAT(status.error_message(), HasSubstr("beta"));
  request = SensorRequest();
  request.set_scans(0, "scans/unknown");
  status = Call(&v1::CalibrationService::Stub::CalibrateSensor, request, &made);
  EXPECT_THAT(status.error_message(), HasSubstr("scans: scans/unknown, want one that the plant knows"));
  v1::CalibrateRotationRequest rotation = RotationRequest();
  rotation.set_machine("machines/other");
  status = Call(&v1::CalibrationService::Stub::CalibrateRotation, rotation, &made);
  EXPECT_THAT(status.error_message(), HasSubstr("machine: machines/other"));
  rotation = RotationRequest();
  rotation.mutable_poses()->DeleteSubrange(1, rotation.poses_size() - 1);
  status = Call(&v1::CalibrationService::Stub::CalibrateRotation, rotation, &made);
  EXPECT_THAT(status.error_message(), HasSubstr("A axis is not determined"));
  EXPECT_EQ(Execute("SELECT count(*) FROM calibrations").Int(0, 0), 0);
  EXPECT_EQ(Execute("SELECT count(*) FROM record_entries WHERE kind = 'calibration'").Int(0, 0), 0);
}

TEST_F(CalibrationServiceTest, RowsAreNeverChanged) {
  v1::Calibration made;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &made).ok());
  for (const std::string sql : {"UPDATE calibrations SET method = 'LINES'", "DELETE FROM rotation_calibration_poses",
                                "UPDATE rotation_calibrations SET noise_um = 0"}) {
    auto transaction = database_.database()->Begin(testing::Soon());
    ASSERT_TRUE(transaction.ok());
    EXPECT_FALSE(transaction->Execute(sql).ok()) << sql;
  }
}

TEST_F(CalibrationServiceTest, ADraftComesIntoForceByItsRelease) {
  v1::CalibrateRotationRequest request = RotationRequest();
  v1::Calibration usual, draft;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &usual).ok());
  EXPECT_EQ(usual.state(), v1::CALIBRATION_STATE_IN_FORCE);
  request.set_draft(true);
  request.mutable_environment()->set_temperature_c(21.5);
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &draft).ok());
  EXPECT_EQ(draft.state(), v1::CALIBRATION_STATE_DRAFT);
  EXPECT_EQ(draft.environment().temperature_c(), 21.5);
  // A newer draft changes nothing.
  EXPECT_EQ(client_.RotationInForce("machines/m1", runtime::ContextFor(10))->name, usual.name());

  v1::ReleaseCalibrationRequest release;
  release.set_name(draft.name());
  release.set_requested_by("head of metrology");
  release.set_request_id(storage::NewUuid());
  v1::Calibration released, again;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ReleaseCalibration, release, &released).ok());
  EXPECT_EQ(released.state(), v1::CALIBRATION_STATE_IN_FORCE);
  EXPECT_EQ(released.release().requested_by(), "head of metrology");
  EXPECT_EQ(client_.RotationInForce("machines/m1", runtime::ContextFor(10))->name, draft.name());
  EXPECT_EQ(StateOf(usual.name()).state(), v1::CALIBRATION_STATE_SUPERSEDED);
  EXPECT_EQ(StateOf(usual.name()).superseded_by(), draft.name());
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ReleaseCalibration, release, &again).ok());
  EXPECT_EQ(again.SerializeAsString(), released.SerializeAsString());
  release.clear_request_id();
  const grpc::Status twice = Call(&v1::CalibrationService::Stub::ReleaseCalibration, release, &again);
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(twice)), "CALIBRATION_NOT_A_DRAFT");
  release.set_name(usual.name());
  EXPECT_THAT(Call(&v1::CalibrationService::Stub::ReleaseCalibration, release, &again).error_message(),
              HasSubstr("never a draft, want a draft"));
}

TEST_F(CalibrationServiceTest, ADraftReleasedLaterIsNewerThanOneMadeInBetween) {
  v1::CalibrateRotationRequest request = RotationRequest();
  v1::Calibration draft, between, released;
  request.set_draft(true);
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &draft).ok());
  EXPECT_EQ(client_.RotationInForce("machines/m1", runtime::ContextFor(10)).status().code(),
            absl::StatusCode::kFailedPrecondition);
  request.set_draft(false);
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &between).ok());
  v1::ReleaseCalibrationRequest release;
  release.set_name(draft.name());
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ReleaseCalibration, release, &released).ok());
  EXPECT_EQ(client_.RotationInForce("machines/m1", runtime::ContextFor(10))->name, draft.name());
}

TEST_F(CalibrationServiceTest, StatesFollowTheClock) {
  v1::CalibrateRotationRequest request = RotationRequest();
  v1::Calibration past, future;
  request.mutable_valid_from()->set_seconds(1'700'000'000);
  request.mutable_valid_until()->set_seconds(1'700'000'100);
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &past).ok());
  EXPECT_EQ(past.state(), v1::CALIBRATION_STATE_EXPIRED);
  request.mutable_valid_from()->set_seconds(4'000'000'000);
  request.mutable_valid_until()->set_seconds(4'000'000'100);
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &future).ok());
  EXPECT_EQ(future.state(), v1::CALIBRATION_STATE_NOT_YET_VALID);
  request.mutable_valid_from()->set_seconds(1'700'000'000);
  request.mutable_valid_until()->set_seconds(1'700'000'100);
  request.set_draft(true);
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &past).ok());
  v1::ReleaseCalibrationRequest release;
  release.set_name(past.name());
  const grpc::Status late = Call(&v1::CalibrationService::Stub::ReleaseCalibration, release, &past);
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(late)), "CALIBRATION_EXPIRED");
}

TEST_F(CalibrationServiceTest, AWithdrawnOneIsNeverGivenAndTheOlderComesBack) {
  v1::Calibration older, newer;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &older).ok());
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &newer).ok());
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(newer.name());
  EXPECT_THAT(std::string(Withdraw(withdraw).status().message()), HasSubstr("reason: empty, want why"));
  withdraw.set_reason("sphere was loose");
  withdraw.set_requested_by("engineer");
  const auto done = Withdraw(withdraw);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->calibration().state(), v1::CALIBRATION_STATE_WITHDRAWN);
  EXPECT_EQ(done->calibration().withdrawal().reason(), "sphere was loose");
  EXPECT_EQ(done->in_force(), older.name());
  EXPECT_EQ(done->resting_size(), 0);
  EXPECT_EQ(client_.RotationInForce("machines/m1", runtime::ContextFor(10))->name, older.name());
  EXPECT_EQ(runtime::ReasonOf(Withdraw(withdraw).status()), "CALIBRATION_WITHDRAWN");
  // For a moment before its withdrawal either.
  v1::GetCalibrationInForceRequest at;
  at.set_machine("machines/m1");
  at.set_kind(v1::CALIBRATION_KIND_ROTATION);
  *at.mutable_at() = newer.recorded_at();
  at.mutable_at()->set_seconds(at.at().seconds() + 1);
  v1::Calibration found;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::GetCalibrationInForce, at, &found).ok());
  EXPECT_EQ(found.name(), older.name());

  withdraw.set_name(older.name());
  EXPECT_EQ(Withdraw(withdraw)->in_force(), "");
  const absl::Status none = client_.RotationInForce("machines/m1", runtime::ContextFor(10)).status();
  EXPECT_EQ(runtime::ReasonOf(none), "CALIBRATION_WITHDRAWN");
  EXPECT_THAT(std::string(none.message()), HasSubstr("was withdrawn (sphere was loose), want one in force"));
  EXPECT_EQ(Execute("SELECT count(*) FROM record_entries WHERE kind = 'withdrawal'").Int(0, 0), 2);
}

TEST_F(CalibrationServiceTest, AWithdrawalListsEverythingThatRestsOnIt) {
  v1::Calibration made;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &made).ok());
  const auto record = [&](const std::string& kind, const std::string& name, const std::vector<std::string>& inputs) {
    storage::RecordEntry entry;
    entry.kind = kind;
    entry.name = name;
    entry.inputs = inputs;
    entry.blade = "SN-1";
    entry.software_version = "test";
    auto transaction = database_.database()->Begin(testing::Soon());
    ASSERT_TRUE(storage::AppendRecord(*transaction, entry).ok());
    ASSERT_TRUE(transaction->Commit().ok());
  };
  record("registration", "registrations/r1", {"scans/high", made.name()});
  record("correction", "corrections/c1", {"registrations/r1"});
  record("registration", "registrations/other", {"scans/high"});
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(made.name());
  withdraw.set_reason("collision");
  withdraw.set_request_id(storage::NewUuid());
  const auto done = Withdraw(withdraw);
  ASSERT_TRUE(done.ok()) << done.status();
  ASSERT_EQ(done->resting_size(), 2);
  EXPECT_EQ(done->resting(0).name(), "registrations/r1");
  EXPECT_EQ(done->resting(1).kind(), "correction");
  EXPECT_THAT(done->blades(), ElementsAre("blades/SN-1"));
  EXPECT_EQ(Withdraw(withdraw)->SerializeAsString(), done->SerializeAsString());  // a retry
}

TEST_F(CalibrationServiceTest, EventsAreNeverChanged) {
  v1::Calibration made;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &made).ok());
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(made.name());
  withdraw.set_reason("collision");
  ASSERT_TRUE(Withdraw(withdraw).ok());
  for (const std::string sql : {"UPDATE calibration_events SET reason = 'none'", "DELETE FROM calibration_events"}) {
    auto transaction = database_.database()->Begin(testing::Soon());
    ASSERT_TRUE(transaction.ok());
    EXPECT_FALSE(transaction->Execute(sql).ok()) << sql;
  }
}

TEST_F(CalibrationServiceTest, TrendAlarmsWhenAnAxisMoved) {
  v1::CalibrateRotationRequest request = RotationRequest();
  v1::Calibration made;
  for (int i = 0; i < 4; ++i) {
    request.mutable_valid_from()->set_seconds(1'790'000'000 + 86400 * i);
    request.mutable_valid_until()->set_seconds(1'790'000'000 + 86400 * (i + 30));
    if (i == 3)  // a collision: the whole table 50 um along X
      for (v1::SpherePose& pose : *request.mutable_poses())
        pose.mutable_centre_mm()->set_x_mm(pose.centre_mm().x_mm() + 0.05);
    ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made).ok());
  }
  v1::GetCalibrationTrendRequest ask;
  ask.set_machine("machines/m1");
  ask.set_kind(v1::CALIBRATION_KIND_ROTATION);
  v1::CalibrationTrend trend;
  const auto get = [&] { return stub_->GetCalibrationTrend(runtime::ContextFor(10).get(), ask, &trend); };
  ASSERT_TRUE(get().ok());
  EXPECT_TRUE(trend.alarm());
  ASSERT_EQ(trend.parameters_size(), 7);
  const v1::ParameterTrend& x = trend.parameters(0);
  EXPECT_EQ(x.parameter(), "point_c_x_mm");
  ASSERT_EQ(x.points_size(), 4);
  EXPECT_THAT(x.alarms(), ::testing::Contains("STEP"));
  EXPECT_NEAR(x.points(3).change(), 0.05, 1e-6);
  EXPECT_NEAR(x.points(3).change_ratio(),
              0.05 / std::hypot(x.points(2).standard_uncertainty(), x.points(3).standard_uncertainty()), 0.1);
  EXPECT_EQ(trend.parameters(1).alarms_size(), 0);

  // Withdrawn, it is no part of the trend.
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(made.name());
  withdraw.set_reason("collision");
  ASSERT_TRUE(Withdraw(withdraw).ok());
  ASSERT_TRUE(get().ok());
  EXPECT_FALSE(trend.alarm());
  EXPECT_EQ(trend.parameters(0).points_size(), 3);

  ask.add_parameters("alpha_deg");
  EXPECT_THAT(get().error_message(), HasSubstr("parameters[0]: alpha_deg, want one of point_c_x_mm"));
  ask.clear_parameters();
  ask.set_coverage_factor(-1);
  EXPECT_THAT(get().error_message(), HasSubstr("coverage_factor"));
  ask.set_coverage_factor(0);
  ask.set_kind(v1::CALIBRATION_KIND_SENSOR);
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(get())), "CALIBRATION_MISSING");
}

TEST_F(CalibrationServiceTest, OddEnvironmentsAreRefused) {
  v1::CalibrateRotationRequest request = RotationRequest();
  v1::Calibration made;
  request.mutable_environment()->set_temperature_c(295);  // kelvin
  EXPECT_THAT(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made).error_message(),
              HasSubstr("environment.temperature_c: 295, want -50 to 100"));
}

}  // namespace
}  // namespace sixpoint::calibration
