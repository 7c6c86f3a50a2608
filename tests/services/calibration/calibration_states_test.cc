// What becomes of calibrations after they are made.
#include <gmock/gmock.h>

#include "tests/services/calibration/calibration_bench.h"

namespace sixpoint::calibration {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CalibrationStatesTest : public CalibrationBench {};

TEST_F(CalibrationStatesTest, ADraftComesIntoForceByItsRelease) {
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
  release.set_request_id(storage::NewUuid());
  v1::Calibration released, again;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::ReleaseCalibration, release, &released).ok());
  EXPECT_EQ(released.state(), v1::CALIBRATION_STATE_IN_FORCE);
  EXPECT_THAT(released.release().requested_by(), ::testing::StartsWith("ipv4:127.0.0.1:"));  // no door, no certificate
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

TEST_F(CalibrationStatesTest, ADraftReleasedLaterIsNewerThanOneMadeInBetween) {
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

TEST_F(CalibrationStatesTest, StatesFollowTheClock) {
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

TEST_F(CalibrationStatesTest, AWithdrawnOneIsNeverGivenAndTheOlderComesBack) {
  v1::Calibration older, newer;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &older).ok());
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &newer).ok());
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(newer.name());
  EXPECT_THAT(std::string(Withdraw(withdraw).status().message()), HasSubstr("reason: empty, want why"));
  withdraw.set_reason("sphere was loose");
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

TEST_F(CalibrationStatesTest, AWithdrawalListsEverythingThatRestsOnIt) {
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
    ASSERT_TRUE(storage::AppendRecord(*transaction, storage::NewUuid(), entry).ok());
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
  EXPECT_EQ(done->resting_count(), 2);
  EXPECT_EQ(done->resting(0).name(), "registrations/r1");
  EXPECT_EQ(done->resting(1).kind(), "correction");
  EXPECT_THAT(done->blades(), ElementsAre("blades/SN-1"));
  EXPECT_EQ(Withdraw(withdraw)->SerializeAsString(), done->SerializeAsString());  // a retry
}

TEST_F(CalibrationStatesTest, AWithdrawalsAnswerIsBounded) {
  v1::Calibration made;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &made).ok());
  constexpr int kResults = 1003;
  auto transaction = database_.database()->Begin(testing::Soon(60));
  for (int i = 0; i < kResults; ++i) {
    storage::RecordEntry entry;
    entry.kind = "registration";
    entry.name = "registrations/r" + std::to_string(i);
    entry.inputs = {made.name()};
    entry.blade = "SN-" + std::to_string(i);
    entry.software_version = "test";
    ASSERT_TRUE(storage::AppendRecord(*transaction, storage::NewUuid(), entry).ok());
  }
  ASSERT_TRUE(transaction->Commit().ok());
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(made.name());
  withdraw.set_reason("collision");
  const auto done = Withdraw(withdraw);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->resting_size(), 1000);
  EXPECT_EQ(done->resting_count(), kResults);
  EXPECT_EQ(done->blades_size(), kResults);
}

TEST_F(CalibrationStatesTest, EventsAreNeverChanged) {
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

TEST_F(CalibrationStatesTest, TrendAlarmsWhenAnAxisMoved) {
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

}  // namespace
}  // namespace sixpoint::calibration
