// How axes position, as calibrations.
#include <gmock/gmock.h>

#include "tests/services/calibration/calibration_bench.h"

namespace sixpoint::calibration {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class AxisServiceTest : public CalibrationBench {
 protected:
  absl::StatusOr<v1::Calibration> InForce(const std::string& axis) {
    v1::GetCalibrationInForceRequest request;
    request.set_machine("machines/m1");
    request.set_kind(v1::CALIBRATION_KIND_AXIS);
    request.set_axis(axis);
    v1::Calibration found;
    const grpc::Status status = Call(&v1::CalibrationService::Stub::GetCalibrationInForce, request, &found);
    if (!status.ok()) return runtime::FromGrpc(status);
    return found;
  }
  // Its name, or why there is none.
  std::string NameInForce(const std::string& axis) {
    const auto found = InForce(axis);
    return found.ok() ? found->name() : std::string(found.status().message());
  }
};

TEST_F(AxisServiceTest, AnAxisIsCharacterisedStoredAndFoundAgain) {
  v1::CharacteriseAxisRequest request = AxisRequest("A");
  request.set_request_id(storage::NewUuid());
  request.mutable_environment()->set_temperature_c(20.5);
  const v1::Calibration made = Characterise(request);
  EXPECT_EQ(made.kind(), v1::CALIBRATION_KIND_AXIS);
  EXPECT_EQ(made.method(), "ENCODER_RUN");
  EXPECT_EQ(made.state(), v1::CALIBRATION_STATE_IN_FORCE);
  EXPECT_THAT(made.requested_by(), ::testing::StartsWith("ipv4:127.0.0.1:"));  // no door, no certificate
  EXPECT_EQ(made.environment().temperature_c(), 20.5);
  EXPECT_EQ(made.valid_until().seconds() - made.valid_from().seconds(), 365 * 86400);
  EXPECT_THAT(made.inputs(), ElementsAre("machines/m1@3"));
  EXPECT_EQ(made.axis().axis(), "A");
  EXPECT_NEAR(made.axis().reversal().value_deg(), 0.015, 1e-9);
  EXPECT_NEAR(made.axis().periodic().period_deg(), 9, 1e-12);
  EXPECT_NEAR(made.axis().periodic().amplitude().value_deg(), 0.003, 1e-9);
  EXPECT_NEAR(made.axis().long_wave().amplitude().value_deg(), 0.012, 1e-9);
  EXPECT_GT(made.axis().table().forward_error_deg_size(), 40);
  EXPECT_EQ(Characterise(request).SerializeAsString(), made.SerializeAsString());
  EXPECT_EQ(Execute("SELECT count(*) FROM axis_characterisations").Int(0, 0), 1);
  // By its name, as any calibration.
  EXPECT_EQ(made.name().rfind("calibrations/", 0), 0u);
  EXPECT_EQ(StateOf(made.name()).SerializeAsString(), made.SerializeAsString());
  const auto in_force = InForce("A");
  ASSERT_TRUE(in_force.ok()) << in_force.status();
  EXPECT_EQ(in_force->SerializeAsString(), made.SerializeAsString());
}

TEST_F(AxisServiceTest, EachAxisHasItsOwnInForceAndItsOwnList) {
  const v1::Calibration older = Characterise(AxisRequest("A")), other = Characterise(AxisRequest("B")),
                        newer = Characterise(AxisRequest("A"));
  EXPECT_EQ(NameInForce("A"), newer.name());
  EXPECT_EQ(NameInForce("B"), other.name());
  EXPECT_EQ(StateOf(older.name()).state(), v1::CALIBRATION_STATE_SUPERSEDED);
  EXPECT_EQ(StateOf(older.name()).superseded_by(), newer.name());
  EXPECT_EQ(StateOf(other.name()).state(), v1::CALIBRATION_STATE_IN_FORCE);

  v1::ListCalibrationsRequest list;
  list.set_machine("machines/m1");
  list.set_kind(v1::CALIBRATION_KIND_AXIS);
  list.set_axis("A");
  list.set_page_size(1);
  v1::ListCalibrationsResponse page;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ListCalibrations, list, &page).ok());
  ASSERT_EQ(page.calibrations_size(), 1);
  EXPECT_EQ(page.calibrations(0).name(), newer.name());
  EXPECT_EQ(page.calibrations(0).axis().reversal().value_deg(), newer.axis().reversal().value_deg());
  EXPECT_EQ(page.calibrations(0).axis().table().forward_error_deg_size(), 0);
  list.set_page_token(page.next_page_token());
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ListCalibrations, list, &page).ok());
  EXPECT_EQ(page.calibrations(0).name(), older.name());
  EXPECT_EQ(page.calibrations(0).state(), v1::CALIBRATION_STATE_SUPERSEDED);
  EXPECT_EQ(page.next_page_token(), "");
  list.clear_page_token();
  list.set_kind(v1::CALIBRATION_KIND_SENSOR);
  EXPECT_THAT(Call(&v1::CalibrationService::Stub::ListCalibrations, list, &page).error_message(),
              HasSubstr("axis: A, want none but for kind CALIBRATION_KIND_AXIS"));
  EXPECT_THAT(std::string(InForce("").status().message()), HasSubstr("axis: empty, want the letter"));
}

TEST_F(AxisServiceTest, ADraftIsNotUsedBeforeItsReleaseNorAfterItsWithdrawal) {
  v1::CalibrateRotationRequest rotation = RotationRequest();
  rotation.set_apply_axis_tables(true);
  v1::CharacteriseAxisRequest request = AxisRequest("A");
  request.set_draft(true);
  const v1::Calibration draft = Characterise(request);
  EXPECT_EQ(draft.state(), v1::CALIBRATION_STATE_DRAFT);
  EXPECT_EQ(runtime::ReasonOf(InForce("A").status()), "CALIBRATION_MISSING");
  v1::Calibration made, released;
  const auto calibrate = [&] {
    return runtime::FromGrpc(Call(&v1::CalibrationService::Stub::CalibrateRotation, rotation, &made));
  };
  EXPECT_EQ(runtime::ReasonOf(calibrate()), "AXIS_NOT_CHARACTERISED");

  v1::ReleaseCalibrationRequest release;
  release.set_name(draft.name());
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ReleaseCalibration, release, &released).ok());
  EXPECT_EQ(released.state(), v1::CALIBRATION_STATE_IN_FORCE);
  EXPECT_THAT(released.release().requested_by(), ::testing::StartsWith("ipv4:127.0.0.1:"));  // no door, no certificate
  ASSERT_TRUE(calibrate().ok());
  EXPECT_THAT(made.inputs(), ElementsAre("machines/m1@3", draft.name()));

  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name("calibrations/" + draft.name().substr(draft.name().find('/') + 1));  // as a person may type it
  withdraw.set_reason("the encoder slipped");
  const auto done = Withdraw(withdraw);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->calibration().name(), draft.name());
  EXPECT_EQ(done->calibration().state(), v1::CALIBRATION_STATE_WITHDRAWN);
  EXPECT_EQ(done->in_force(), "");
  ASSERT_EQ(done->resting_size(), 1);
  EXPECT_EQ(done->resting(0).name(), made.name());
  EXPECT_EQ(done->resting(0).kind(), "calibration");
  EXPECT_EQ(runtime::ReasonOf(InForce("A").status()), "CALIBRATION_WITHDRAWN");
  EXPECT_THAT(std::string(InForce("A").status().message()),
              HasSubstr("its characterisation of axis A " + draft.name() + " was withdrawn (the encoder slipped)"));
  EXPECT_EQ(runtime::ReasonOf(calibrate()), "AXIS_NOT_CHARACTERISED");
  EXPECT_EQ(runtime::ReasonOf(Withdraw(withdraw).status()), "CALIBRATION_WITHDRAWN");
}

TEST_F(AxisServiceTest, TheOlderOneComesBackAndAnOldOneExpires) {
  v1::CharacteriseAxisRequest past = AxisRequest("A");
  past.mutable_valid_from()->set_seconds(1'700'000'000);
  past.mutable_valid_until()->set_seconds(1'700'000'100);
  EXPECT_EQ(Characterise(past).state(), v1::CALIBRATION_STATE_EXPIRED);
  EXPECT_EQ(runtime::ReasonOf(InForce("A").status()), "CALIBRATION_EXPIRED");
  const v1::Calibration older = Characterise(AxisRequest("A"));
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(Characterise(AxisRequest("A")).name());
  withdraw.set_reason("wrong axis");
  const auto done = Withdraw(withdraw);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->in_force(), older.name());
  EXPECT_EQ(NameInForce("A"), older.name());
}

// A calibration of the axes that was computed with a table while somebody withdrew it.
TEST_F(AxisServiceTest, NothingComesToRestOnAWithdrawnOne) {
  const v1::Calibration axis = Characterise(AxisRequest("A"));
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(axis.name());
  withdraw.set_reason("the encoder slipped");
  ASSERT_TRUE(Withdraw(withdraw).ok());
  storage::RecordEntry entry;
  entry.kind = "calibration";
  entry.name = "calibrations/" + storage::NewUuid();
  entry.inputs = {"machines/m1@3", axis.name()};
  entry.software_version = "test";
  const auto append = [&] {
    auto transaction = database_.database()->Begin(testing::Soon());
    EXPECT_TRUE(transaction.ok()) << transaction.status();
    return storage::AppendRecord(*transaction, storage::NewUuid(), entry).status();
  };
  const absl::Status refused = append();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr(axis.name() + ": withdrawn, want one in force"));
  entry.kind = "study";  // which may look at anything
  entry.name = "studies/" + storage::NewUuid();
  EXPECT_TRUE(append().ok());
}

TEST_F(AxisServiceTest, ReadingsBeyondTheAxisLimitsAreCounted) {
  EXPECT_EQ(Characterise(AxisRequest("A")).axis().beyond_limits_count(), 0);  // no limits in the record
  v1::CharacteriseAxisRequest request = AxisRequest("B");
  request.set_machine("machines/m2");
  // -10 to 370 deg each way, limits at +-110: 111 to 370.
  EXPECT_EQ(Characterise(request).axis().beyond_limits_count(), 2 * 260);
  request.set_axis("C");  // limits at +-360
  EXPECT_EQ(Characterise(request).axis().beyond_limits_count(), 2 * 10);
}

TEST_F(AxisServiceTest, TrendAlarmsWhereTheReversalGrew) {
  v1::GetCalibrationTrendRequest ask;
  ask.set_machine("machines/m1");
  ask.set_kind(v1::CALIBRATION_KIND_AXIS);
  v1::CalibrationTrend trend;
  const auto get = [&] { return Call(&v1::CalibrationService::Stub::GetCalibrationTrend, ask, &trend); };
  EXPECT_THAT(get().error_message(), HasSubstr("axis: empty, want the letter of a rotary axis"));
  ask.set_axis("A");
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(get())), "CALIBRATION_MISSING");
  std::vector<v1::Calibration> made;
  for (int i = 0; i < 4; ++i) {
    v1::CharacteriseAxisRequest request = AxisRequest("A", i == 3 ? 0.019 : 0.015, 5e-4, 10 + i);
    request.mutable_valid_from()->set_seconds(1'790'000'000 + 86400 * 30 * i);
    made.push_back(Characterise(request));
  }
  Characterise(AxisRequest("B", 0.05, 5e-4));  // no part of it
  ASSERT_TRUE(get().ok());
  EXPECT_EQ(trend.axis(), "A");
  ASSERT_EQ(trend.parameters_size(), 5);
  const v1::ParameterTrend& reversal = trend.parameters(0);
  EXPECT_EQ(reversal.parameter(), "reversal_deg");
  ASSERT_EQ(reversal.points_size(), 4);
  EXPECT_EQ(reversal.points(3).calibration(), made[3].name());
  EXPECT_THAT(reversal.alarms(), ::testing::Contains("STEP"));
  EXPECT_FALSE(reversal.points(2).alarm());
  // 762 readings of 0.0005 deg: 0.00004 deg each, of which ten would be no coincidence.
  EXPECT_NEAR(reversal.points(3).change(), 0.004, 4e-4);
  EXPECT_EQ(trend.parameters(3).parameter(), "periodic_amplitude_deg");
  EXPECT_EQ(trend.parameters(3).points_size(), 4);
  ask.add_parameters("alpha_deg");
  EXPECT_THAT(get().error_message(), HasSubstr("parameters[0]: alpha_deg, want one of reversal_deg"));
}

TEST_F(AxisServiceTest, RunsThatTellNothingAreRefused) {
  v1::Calibration made;
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

TEST_F(AxisServiceTest, AxisTablesAreAppliedWhereAsked) {
  v1::CalibrateRotationRequest request = RotationRequest();
  request.set_apply_axis_tables(true);
  v1::Calibration made, plain;
  const grpc::Status none = Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made);
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(none)), "AXIS_NOT_CHARACTERISED");
  const v1::Calibration axis = Characterise(AxisRequest("A"));
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

}  // namespace
}  // namespace sixpoint::calibration
