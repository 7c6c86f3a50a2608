// How a snapshot sensor stands, stated by a certificate: recorded as a calibration like any other, but for evidence that there is none of.
#include <gmock/gmock.h>

#include "metrology/frames/pose.h"
#include "tests/services/calibration/calibration_bench.h"

namespace sixpoint::calibration {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class StatedPoseTest : public CalibrationBench {
 protected:
  StatedPoseTest() { plant_.sensor_kind = plant::v1::SENSOR_KIND_SNAPSHOT; }

  static v1::StateSensorPoseRequest StatedRequest() {
    v1::StateSensorPoseRequest request;
    request.set_machine("machines/m1");
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = metrology::RotationFromCardan({0.3, -0.2, 1.1});
    pose.translation() = Eigen::Vector3d(12, -34, 560);
    runtime::ToProto(pose, request.mutable_machine_from_sensor());
    request.set_turn_standard_uncertainty_deg(0.002);
    request.set_shift_standard_uncertainty_um(5);
    request.set_certificate("K-17, Metrolab");
    request.set_sensor_serial_number("A-4");
    request.set_request_id(storage::NewUuid());
    return request;
  }
  absl::StatusOr<v1::Calibration> State(const v1::StateSensorPoseRequest& request) {
    v1::Calibration made;
    const grpc::Status status = Call(&v1::CalibrationService::Stub::StateSensorPose, request, &made);
    if (!status.ok()) return runtime::FromGrpc(status);
    return made;
  }
};

TEST_F(StatedPoseTest, IsACalibrationThatMapsSnapshots) {
  const v1::StateSensorPoseRequest request = StatedRequest();
  const auto made = State(request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->kind(), v1::CALIBRATION_KIND_SENSOR);
  EXPECT_EQ(made->method(), "STATED");
  EXPECT_EQ(made->state(), v1::CALIBRATION_STATE_IN_FORCE);
  EXPECT_THAT(made->inputs(), ElementsAre("machines/m1@3"));
  EXPECT_EQ(made->valid_until().seconds() - made->valid_from().seconds(), 30 * 86400);
  const v1::SensorCalibration& sensor = made->sensor();
  EXPECT_EQ(sensor.certificate(), "K-17, Metrolab");
  EXPECT_EQ(sensor.sensor_serial_number(), "A-4");
  EXPECT_NEAR(sensor.alpha_deg() * kDeg, 0.3, 1e-12);
  EXPECT_NEAR(sensor.gamma_deg() * kDeg, 1.1, 1e-12);
  EXPECT_NEAR(sensor.t_sm_standard_uncertainty_mm().z_mm(), 5e-3, 1e-15);
  EXPECT_NEAR(sensor.beta_standard_uncertainty_deg(), 0.002, 1e-12);
  EXPECT_EQ(sensor.residual_rms_um(), 0);
  EXPECT_EQ(sensor.condition_number(), 0);
  EXPECT_EQ(StateOf(made->name()).SerializeAsString(), made->SerializeAsString());
  // What there is none of is none, not 0.
  EXPECT_EQ(Execute("SELECT num_nulls(noise_um, touch_rms_um, residual_rms_um, condition_number, points_used) "
                    "FROM sensor_calibrations")
                .Int(0, 0),
            5);
  EXPECT_EQ(Execute("SELECT count(*) FROM read_v1.calibrations WHERE method = 'STATED' AND residual_rms_um IS NULL")
                .Int(0, 0),
            1);

  const auto in_force = client_.SensorInForce("machines/m1", runtime::ContextFor(10));
  ASSERT_TRUE(in_force.ok()) << in_force.status();
  EXPECT_EQ(in_force->sensor.cloud, metrology::CloudKind::kSnapshot);
  EXPECT_NEAR(in_force->sensor.covariance(0, 0), std::pow(0.002 * kDeg, 2), 1e-18);
  EXPECT_NEAR(in_force->sensor.covariance(5, 5), 25e-6, 1e-18);
  EXPECT_EQ(in_force->sensor.covariance(0, 5), 0);
  // The same request again is the same calibration; another under its id is refused.
  EXPECT_EQ(State(request)->name(), made->name());
  v1::StateSensorPoseRequest other = request;
  other.set_shift_standard_uncertainty_um(6);
  EXPECT_EQ(State(other).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(StatedPoseTest, LivesAsAllCalibrationsDo) {
  const auto first = State(StatedRequest());
  ASSERT_TRUE(first.ok()) << first.status();
  v1::StateSensorPoseRequest request = StatedRequest();
  request.set_draft(true);
  const auto draft = State(request);
  ASSERT_TRUE(draft.ok()) << draft.status();
  EXPECT_EQ(draft->state(), v1::CALIBRATION_STATE_DRAFT);
  EXPECT_EQ(client_.SensorInForce("machines/m1", runtime::ContextFor(10))->name, first->name());
  v1::ReleaseCalibrationRequest release;
  release.set_name(draft->name());
  v1::Calibration released;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ReleaseCalibration, release, &released).ok());
  EXPECT_EQ(StateOf(first->name()).state(), v1::CALIBRATION_STATE_SUPERSEDED);
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(draft->name());
  withdraw.set_reason("the bracket was bent");
  withdraw.set_request_id(storage::NewUuid());
  const auto withdrawn = Withdraw(withdraw);
  ASSERT_TRUE(withdrawn.ok()) << withdrawn.status();
  EXPECT_EQ(withdrawn->in_force(), first->name());
}

TEST_F(StatedPoseTest, IsRefusedWhereItSaysTooLittleOrOfAnotherSensor) {
  const auto refused = [&](auto spoil) {
    v1::StateSensorPoseRequest request = StatedRequest();
    spoil(&request);
    return State(request).status();
  };
  using Request = v1::StateSensorPoseRequest;
  const auto says = [&](auto spoil, const std::string& what) {
    const absl::Status status = refused(spoil);
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << what << ": " << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(what));
  };
  says([](Request* r) { r->clear_certificate(); }, "certificate: ");
  says([](Request* r) { r->clear_machine_from_sensor(); }, "machine_from_sensor: missing");
  says([](Request* r) { r->clear_turn_standard_uncertainty_deg(); }, "turn_standard_uncertainty_deg: 0, want > 0");
  says([](Request* r) { r->set_shift_standard_uncertainty_um(std::nan("")); }, "shift_standard_uncertainty_um: NaN");
  says([](Request* r) { r->set_shift_standard_uncertainty_um(20'000); }, "want > 0 and at most 10000");
  says([](Request* r) { r->mutable_machine_from_sensor()->set_rotation(0, 0.5); }, "machine_from_sensor.rotation");
  says([](Request* r) { r->mutable_machine_from_sensor()->mutable_translation_mm()->set_x_mm(2e5); },
       "machine_from_sensor.translation_mm: 200000");
  plant_.sensor_kind = plant::v1::SENSOR_KIND_LINE;
  const absl::Status line = refused([](Request*) {});
  EXPECT_EQ(runtime::ReasonOf(line), "SENSOR_UNSUITABLE");
  EXPECT_THAT(std::string(line.message()), HasSubstr("with an artefact (CalibrateSensor)"));
  EXPECT_EQ(Execute("SELECT count(*) FROM calibrations").Int(0, 0), 0);
}

// What asks a scanner's artefact takes no stated pose, and a snapshot machine is not calibrated by an artefact.
TEST_F(StatedPoseTest, IsNoScannerThatAnArtefactShowed) {
  const auto made = State(StatedRequest());
  ASSERT_TRUE(made.ok()) << made.status();
  v1::Calibration measured;
  const absl::Status sensor =
      runtime::FromGrpc(Call(&v1::CalibrationService::Stub::CalibrateSensor, SensorRequest(), &measured));
  EXPECT_EQ(runtime::ReasonOf(sensor), "SENSOR_UNSUITABLE");
  EXPECT_THAT(std::string(sensor.message()), HasSubstr("is stated (StateSensorPose)"));
  // Rotary axes are a machine's, whatever its sensor.
  EXPECT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &measured).ok());
  // Beta a right angle: alpha and gamma are not known apart, the turn is.
  v1::StateSensorPoseRequest side = StatedRequest();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  runtime::ToProto(pose, side.mutable_machine_from_sensor());
  const auto sideways = State(side);
  ASSERT_TRUE(sideways.ok()) << sideways.status();
  EXPECT_NEAR(sideways->sensor().beta_deg(), 90, 1e-6);
  EXPECT_GT(sideways->sensor().alpha_standard_uncertainty_deg(), 1);
}

}  // namespace
}  // namespace sixpoint::calibration
