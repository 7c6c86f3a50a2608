// Calibrations made, stored, listed and in force.
#include <gmock/gmock.h>

#include "tests/services/calibration/calibration_bench.h"

namespace sixpoint::calibration {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CalibrationServiceTest : public CalibrationBench {};

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

// What was scanned since the scanner showed the artefact is mapped by it; what was scanned before is not.
TEST_F(CalibrationServiceTest, ReachesBackToItsFirstScan) {
  ingest_.sensor_serial_number = "0815";
  ingest_.travel = ingest::v1::SCAN_TRAVEL_FORWARD;
  v1::Calibration made;
  const grpc::Status status = Call(&v1::CalibrationService::Stub::CalibrateSensor, SensorRequest(), &made);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(made.valid_from().seconds(), ingest_.received_s);
  EXPECT_EQ(made.valid_until().seconds() - made.valid_from().seconds(), 30 * 86400);
  EXPECT_EQ(made.sensor().sensor_serial_number(), "0815");
  EXPECT_EQ(made.sensor().travel(), ingest::v1::SCAN_TRAVEL_FORWARD);
  google::protobuf::Timestamp at;
  at.set_seconds(ingest_.received_s);
  const auto then = client_.SensorInForceAt("machines/m1", at, runtime::ContextFor(10));
  ASSERT_TRUE(then.ok()) << then.status();
  EXPECT_EQ(then->name, made.name());
  EXPECT_EQ(then->travel, ingest::v1::SCAN_TRAVEL_FORWARD);
  at.set_seconds(ingest_.received_s - 1);
  EXPECT_EQ(runtime::ReasonOf(client_.SensorInForceAt("machines/m1", at, runtime::ContextFor(10)).status()),
            "CALIBRATION_MISSING");
}

// A feature that is touched elsewhere than it is scanned moves the scanner by its share of what is touched.
TEST_F(CalibrationServiceTest, TheArtefactsRecordWidensTheCovariance) {
  v1::Calibration without, with;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateSensor, SensorRequest(), &without).ok());
  plant_.centre_standard_uncertainty_um = 3;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateSensor, SensorRequest(), &with).ok());
  EXPECT_EQ(with.sensor().t_sm_mm().SerializeAsString(), without.sensor().t_sm_mm().SerializeAsString());
  // T_sm along X and Y: three cones among all that is touched along it.
  for (const auto& [k, faces] : {std::pair(21, touch_.side_x_mm.size()), std::pair(28, touch_.side_y_mm.size())}) {
    const double more_um =
        1e3 * std::sqrt(with.sensor().covariance().values(k) - without.sensor().covariance().values(k));
    EXPECT_NEAR(more_um, 3 * std::sqrt(3.0) / (3 + static_cast<double>(faces)), 0.01) << k;
  }
}

TEST_F(CalibrationServiceTest, NothingIsCalibratedByWhatExpired) {
  plant::v1::Certificate ended;
  ended.set_number("D-1201");
  ended.mutable_expires_at()->set_seconds(ingest_.received_s);
  plant_.certificate = ended;
  v1::Calibration made;
  const auto sensor = [&] {
    return runtime::FromGrpc(Call(&v1::CalibrationService::Stub::CalibrateSensor, SensorRequest(), &made));
  };
  EXPECT_EQ(runtime::ReasonOf(sensor()), "REFERENCE_EXPIRED");
  EXPECT_THAT(std::string(sensor().message()), HasSubstr("artefacts/a1.certificate: D-1201, which ended on"));
  plant_.certificate->mutable_expires_at()->set_seconds(ingest_.received_s + 1);
  EXPECT_TRUE(sensor().ok()) << sensor();
  plant_.touch_probe_certificate = ended;
  EXPECT_EQ(runtime::ReasonOf(sensor()), "REFERENCE_EXPIRED");
  EXPECT_EQ(runtime::ReasonOf(
                runtime::FromGrpc(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &made))),
            "REFERENCE_EXPIRED");
  plant_.touch_probe_certificate.reset();
  plant_.sensor_kind = plant::v1::SENSOR_KIND_SNAPSHOT;
  EXPECT_EQ(runtime::ReasonOf(sensor()), "SENSOR_UNSUITABLE");
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

// Point C claims axes that meet; these stand 9 um apart.
TEST_F(CalibrationServiceTest, WhatDoesNotAgreeWithItselfIsInForceOnlyOnceAPersonLookedAtIt) {
  v1::CalibrateRotationRequest request = RotationRequest();
  v1::Calibration lines, point_c;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &lines).ok());
  EXPECT_EQ(lines.state(), v1::CALIBRATION_STATE_IN_FORCE);
  ASSERT_EQ(lines.judgements_size(), 1);
  EXPECT_EQ(lines.judgements(0).of(), "held-out poses");
  EXPECT_TRUE(lines.judgements(0).agrees());
  request.set_method(v1::ROTATION_METHOD_POINT_C);
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &point_c).ok());
  ASSERT_EQ(point_c.judgements_size(), 1);
  EXPECT_FALSE(point_c.judgements(0).agrees());
  EXPECT_GT(point_c.judgements(0).ratio(), 5);
  EXPECT_LT(point_c.judgements(0).probability(), 1e-3);
  EXPECT_EQ(point_c.state(), v1::CALIBRATION_STATE_DRAFT);
  EXPECT_EQ(client_.RotationInForce("machines/m1", runtime::ContextFor(10))->name, lines.name());
  v1::ReleaseCalibrationRequest release;
  release.set_name(point_c.name());
  release.set_reason("for the comparison with the paper");
  v1::Calibration released;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ReleaseCalibration, release, &released).ok());
  EXPECT_EQ(client_.RotationInForce("machines/m1", runtime::ContextFor(10))->name, point_c.name());
}

TEST_F(CalibrationServiceTest, TheNewestValidOneIsInForce) {
  const auto missing = client_.RotationInForce("machines/m1", runtime::ContextFor(10));
  EXPECT_EQ(missing.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(runtime::ReasonOf(missing.status()), "CALIBRATION_MISSING");

  v1::CalibrateRotationRequest request = RotationRequest();
  v1::Calibration old, newer, past;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &old).ok());
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

  const auto of_state = [&](v1::CalibrationState state) {
    request.Clear();
    request.set_state(state);
    v1::ListCalibrationsResponse page;
    EXPECT_TRUE(stub_->ListCalibrations(runtime::ContextFor(10).get(), request, &page).ok());
    for (const v1::Calibration& c : page.calibrations()) EXPECT_EQ(c.state(), state);
    return page.calibrations_size();
  };
  EXPECT_EQ(of_state(v1::CALIBRATION_STATE_IN_FORCE), 1);
  EXPECT_EQ(of_state(v1::CALIBRATION_STATE_SUPERSEDED), 4);
  EXPECT_EQ(of_state(v1::CALIBRATION_STATE_WITHDRAWN), 0);

  request.Clear();
  v1::ListCalibrationsResponse basic, full;
  ASSERT_TRUE(stub_->ListCalibrations(runtime::ContextFor(10).get(), request, &basic).ok());
  EXPECT_EQ(basic.calibrations(0).rotation().residuals_size(), 0);
  request.set_view(list::v1::VIEW_FULL);
  ASSERT_TRUE(stub_->ListCalibrations(runtime::ContextFor(10).get(), request, &full).ok());
  EXPECT_EQ(full.calibrations(0).rotation().residuals_size(), RotationRequest().poses_size());
  *request.mutable_recorded()->mutable_until() = full.calibrations(0).recorded_at();
  ASSERT_TRUE(stub_->ListCalibrations(runtime::ContextFor(10).get(), request, &full).ok());
  EXPECT_EQ(full.calibrations_size(), 4);
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

// As those from before it was kept.
TEST_F(CalibrationServiceTest, APoseWithoutItsErrorBeforeReadsBackWithoutIt) {
  v1::Calibration made;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &made).ok());
  auto transaction = database_.database()->Begin(testing::Soon());
  ASSERT_TRUE(transaction.ok());
  auto row = storage::FindCalibration(*transaction, made.name().substr(made.name().find('/') + 1));
  ASSERT_TRUE(row.ok() && row->has_value());
  ASSERT_TRUE((**row).rotation->poses[1].before_um);
  (**row).calibration_id = storage::NewUuid();
  (**row).rotation->poses[1].before_um.reset();
  (**row).rotation->poses[2].before_um = 0;
  storage::RecordEntry entry;
  entry.kind = "calibration";
  entry.name = (**row).name();
  entry.software_version = "test";
  ASSERT_TRUE(storage::InsertCalibration(*transaction, **row, entry).ok());
  const auto again = storage::FindCalibration(*transaction, (**row).calibration_id);
  ASSERT_TRUE(again.ok() && again->has_value());
  EXPECT_EQ((**again).rotation->poses[0].before_um, (**row).rotation->poses[0].before_um);
  EXPECT_FALSE((**again).rotation->poses[1].before_um);
  EXPECT_EQ((**again).rotation->poses[2].before_um, 0);
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

TEST_F(CalibrationServiceTest, OddEnvironmentsAreRefused) {
  v1::CalibrateRotationRequest request = RotationRequest();
  v1::Calibration made;
  request.mutable_environment()->set_temperature_c(295);  // kelvin
  EXPECT_THAT(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made).error_message(),
              HasSubstr("environment.temperature_c: 295, want -50 to 100"));
}

}  // namespace
}  // namespace sixpoint::calibration
