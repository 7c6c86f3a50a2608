// CalibrateProbe over real gRPC on a real PostgreSQL, beside a plant that is stood in for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/calibration/calibration_service.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "tests/metrology/calibration/probe_bench.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::calibration {
namespace {

using sixpoint::testing::ProbeBench;
using ::testing::HasSubstr;

class PlantWithProbe final : public plant::v1::PlantService::Service {
 public:
  plant::v1::TouchProbe touch_probe;
  grpc::Status GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest* request,
                          plant::v1::Machine* out) override {
    if (request->name() != "machines/m1") return {grpc::StatusCode::NOT_FOUND, "no such machine"};
    out->set_name("machines/m1");
    out->set_revision(3);
    *out->mutable_touch_probe() = touch_probe;
    return grpc::Status::OK;
  }
};

class ProbeServiceTest : public ::testing::Test {
 protected:
  ProbeServiceTest()
      : plant_server_({&plant_}),
        service_(storage::CalibrationsIn(database_.database()), storage::StudiesIn(database_.database()),
                 plant_server_.Connect(), plant_server_.Connect(), 1),
        server_({&service_}),
        stub_(v1::CalibrationService::NewStub(server_.Connect())) {
    auto transaction = database_.database()->Begin(testing::Soon());
    testing::RegisterMachine(*transaction, "m1", 3);
    EXPECT_TRUE(transaction->Commit().ok());
    std::mt19937_64 random(2);
    const ProbeBench bench, moved(0.785, {20, 90, -180}, 1.2);
    request_.set_machine("machines/m1");
    request_.set_block("block-45");
    request_.set_noise_um(2.18);
    request_.set_touch_standard_uncertainty_um(0.53);
    request_.set_least_displacement_mm(-5);
    request_.set_greatest_displacement_mm(5);
    Add(bench.Touch(&random), bench.Measure(&random), request_.mutable_faces(), request_.mutable_readings());
    Add(moved.Touch(&random), moved.Measure(&random), request_.mutable_moved_faces(),
        request_.mutable_moved_readings());
  }
  template <typename Faces, typename Readings>
  static void Add(const std::vector<metrology::ProbedFace>& faces, const std::vector<metrology::ProbeReading>& readings,
                  Faces* faces_out, Readings* readings_out) {
    for (const metrology::ProbedFace& face : faces) {
      v1::ProbedFace* out = faces_out->Add();
      out->set_face(face.face);
      runtime::ToProto(face.nominal_normal, out->mutable_nominal_normal());
      for (const Eigen::Vector3d& p : face.touched_mm) runtime::ToProto(p, out->add_touched_mm());
    }
    for (const metrology::ProbeReading& reading : readings) {
      v1::ProbeReading* out = readings_out->Add();
      out->set_face(reading.face);
      runtime::ToProto(reading.position_mm, out->mutable_position_mm());
      out->set_displacement_mm(reading.displacement_mm);
    }
  }
  storage::Rows Execute(const std::string& sql) {
    auto transaction = database_.database()->Begin(testing::Soon());
    EXPECT_TRUE(transaction.ok()) << transaction.status();
    const auto rows = transaction->Execute(sql);
    EXPECT_TRUE(rows.ok()) << rows.status();
    EXPECT_TRUE(transaction->Commit().ok());
    return rows.ok() ? *rows : storage::Rows();
  }
  grpc::Status Calibrate(v1::Calibration* made) {
    grpc::ClientContext context;
    return stub_->CalibrateProbe(&context, request_, made);
  }

  testing::ThrowawayDatabase database_;
  PlantWithProbe plant_;
  testing::InProcessServer plant_server_;
  CalibrationService service_;
  testing::InProcessServer server_;
  std::unique_ptr<v1::CalibrationService::Stub> stub_;
  v1::CalibrateProbeRequest request_;
};

TEST_F(ProbeServiceTest, NothingIsCalibratedByATouchProbeWhoseCertificateIsOver) {
  plant_.touch_probe.mutable_certificate()->mutable_expires_at()->set_seconds(1'500'000'000);
  v1::Calibration made;
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(Calibrate(&made))), "REFERENCE_EXPIRED");
}

TEST_F(ProbeServiceTest, IsStoredWholeAndInForceToTheSameBits) {
  v1::Calibration made, in_force, got;
  const grpc::Status status = Calibrate(&made);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(made.kind(), v1::CALIBRATION_KIND_PROBE);
  EXPECT_EQ(made.method(), "WEIGHTED");
  EXPECT_EQ(made.inputs(0), "machines/m1@3");
  ASSERT_EQ(made.probe().approach_size(), 3);
  EXPECT_NEAR(made.probe().scale(), 1.0007, 5e-4);
  EXPECT_NEAR(made.probe().offset_mm().z_mm(), -150.27, 0.01);
  EXPECT_EQ(made.probe().residuals_size(), 48);
  ASSERT_EQ(made.probe().check_size(), 3);
  EXPECT_LT(made.probe().check(0).angle_urad(), 410);
  v1::GetCalibrationInForceRequest query;
  query.set_machine("machines/m1");
  query.set_kind(v1::CALIBRATION_KIND_PROBE);
  grpc::ClientContext first, second, third;
  ASSERT_TRUE(stub_->GetCalibrationInForce(&first, query, &in_force).ok());
  EXPECT_EQ(in_force.SerializeAsString(), made.SerializeAsString());
  v1::GetCalibrationRequest get;
  get.set_name(made.name());
  ASSERT_TRUE(stub_->GetCalibration(&second, get, &got).ok());
  EXPECT_EQ(got.SerializeAsString(), made.SerializeAsString());
  query.set_kind(v1::CALIBRATION_KIND_SENSOR);
  EXPECT_EQ(stub_->GetCalibrationInForce(&third, query, &got).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
}

TEST_F(ProbeServiceTest, TheSameRequestIdIsOneCalibrationAndTheLinearMethodIsKeptAsSuch) {
  request_.set_request_id("6f1e7a44-3a0e-4a35-9d7e-2f8f0f1c9a11");
  request_.set_method(v1::PROBE_METHOD_LINEAR);
  v1::Calibration first, second;
  ASSERT_TRUE(Calibrate(&first).ok());
  ASSERT_TRUE(Calibrate(&second).ok());
  EXPECT_EQ(first.SerializeAsString(), second.SerializeAsString());
  EXPECT_EQ(first.method(), "LINEAR");
  EXPECT_EQ(Execute("SELECT 1 FROM probe_calibrations").count(), 1);
}

TEST_F(ProbeServiceTest, RefusalsStoreNothingAndSayWhat) {
  const v1::CalibrateProbeRequest good = request_;
  v1::Calibration made;
  const auto refused = [&](grpc::StatusCode code, const std::string& says) {
    const grpc::Status status = Calibrate(&made);
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(says));
    request_ = good;
  };
  request_.set_machine("machines/m9");
  refused(grpc::StatusCode::INVALID_ARGUMENT, "machines/m9");
  request_.mutable_readings()->DeleteSubrange(5, request_.readings_size() - 5);
  refused(grpc::StatusCode::FAILED_PRECONDITION, "5 readings");
  request_.mutable_readings(1)->mutable_position_mm()->set_x_mm(std::numeric_limits<double>::quiet_NaN());
  refused(grpc::StatusCode::INVALID_ARGUMENT, "readings[1].position_mm");
  request_.mutable_readings(3)->set_displacement_mm(7.5);
  refused(grpc::StatusCode::INVALID_ARGUMENT, "readings[3].displacement_mm: 7.5, want -5 to 5");
  request_.mutable_moved_readings(3)->set_displacement_mm(7.5);
  refused(grpc::StatusCode::INVALID_ARGUMENT, "moved_readings[3].displacement_mm");
  request_.mutable_moved_faces()->Clear();
  refused(grpc::StatusCode::INVALID_ARGUMENT, "moved_faces");
  for (auto& r : *request_.mutable_readings()) r.set_displacement_mm(r.displacement_mm() / 25.4);
  refused(grpc::StatusCode::INVALID_ARGUMENT, "inch");
  EXPECT_EQ(Execute("SELECT 1 FROM calibrations").count(), 0);
}

TEST_F(ProbeServiceTest, TrendAlarmsWhereTheProbeWasKnocked) {
  v1::Calibration made;
  for (int i = 0; i < 4; ++i) {
    request_.mutable_valid_from()->set_seconds(1'790'000'000 + 86400 * i);
    if (i == 3)  // 0.1 mm along X in the spindle
      for (v1::ProbeReading& reading : *request_.mutable_readings())
        reading.mutable_position_mm()->set_x_mm(reading.position_mm().x_mm() - 0.1);
    const grpc::Status status = Calibrate(&made);
    ASSERT_TRUE(status.ok()) << status.error_message();
  }
  v1::GetCalibrationTrendRequest ask;
  ask.set_machine("machines/m1");
  ask.set_kind(v1::CALIBRATION_KIND_PROBE);
  v1::CalibrationTrend trend;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->GetCalibrationTrend(&context, ask, &trend).ok());
  EXPECT_TRUE(trend.alarm());
  ASSERT_EQ(trend.parameters_size(), 7);
  const v1::ParameterTrend& x = trend.parameters(3);
  EXPECT_EQ(x.parameter(), "offset_x_mm");
  ASSERT_EQ(x.points_size(), 4);
  EXPECT_EQ(x.points(3).calibration(), made.name());
  EXPECT_NEAR(x.points(3).change(), 0.1, 1e-6);
  EXPECT_EQ(x.points(3).standard_uncertainty(), std::sqrt(made.probe().covariance().values(21)));
  EXPECT_TRUE(x.points(3).alarm());
  EXPECT_FALSE(x.points(2).alarm());
  EXPECT_EQ(trend.parameters(4).alarms_size(), 0);
  EXPECT_EQ(trend.parameters(6).parameter(), "scale");
  EXPECT_EQ(trend.parameters(6).alarms_size(), 0);
}

TEST_F(ProbeServiceTest, RowsAreNeverChanged) {
  v1::Calibration made;
  ASSERT_TRUE(Calibrate(&made).ok());
  for (const std::string table : {"probe_calibrations", "probe_calibration_readings", "probe_calibration_checks"}) {
    auto transaction = database_.database()->Begin(testing::Soon());
    EXPECT_FALSE(transaction->Execute("DELETE FROM " + table).ok()) << table;
  }
}

}  // namespace
}  // namespace sixpoint::calibration
