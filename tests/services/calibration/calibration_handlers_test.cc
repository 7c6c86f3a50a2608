// The handlers on fake stores: no PostgreSQL. What is computed is tested in calibration_service_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/calibration/calibration_service.h"
#include "services/calibration/messages.h"
#include "services/calibration/study_service.h"
#include "services/runtime/errors.h"
#include "tests/services/calibration/stand_ins.h"
#include "tests/support/call.h"
#include "tests/support/fake_calibrations.h"
#include "tests/support/fake_results.h"
#include "tests/support/in_process_server.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::calibration {
namespace {

using sixpoint::testing::kSomeUuid;
using testing::Call;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Stub = v1::CalibrationService::Stub;
using Studies = testing::FakeResults<storage::StudyRow, storage::StudyFilter>;

class CalibrationHandlersTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::Calibration> Characterise(const v1::CharacteriseAxisRequest& request) {
    return Call(*stub_, &Stub::CharacteriseAxis, request);
  }
  absl::StatusOr<v1::Calibration> Rotate(const v1::CalibrateRotationRequest& request) {
    return Call(*stub_, &Stub::CalibrateRotation, request);
  }
  absl::StatusOr<v1::Calibration> Get(const std::string& name) {
    v1::GetCalibrationRequest request;
    request.set_name(name);
    return Call(*stub_, &Stub::GetCalibration, request);
  }

  testing::ArtefactBench bench_ = testing::ArtefactBench::Usual();
  FakePlant plant_{bench_};
  FakeIngest ingest_;
  std::unique_ptr<testing::InProcessServer> peers_ =
      std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{&plant_, &ingest_});
  std::shared_ptr<testing::FakeCalibrations> store_ = std::make_shared<testing::FakeCalibrations>();
  std::shared_ptr<Studies> studies_ = std::make_shared<Studies>(
      &storage::StudyRow::study_id, [](const storage::StudyRow&, const storage::StudyFilter&) { return true; });
  CalibrationService service_{store_, studies_, peers_->Connect(), peers_->Connect(), 1};
  StudyService study_service_{studies_, store_, peers_->Connect(), peers_->Connect()};
  testing::InProcessServer server_{{&service_, &study_service_}};
  std::unique_ptr<Stub> stub_ = v1::CalibrationService::NewStub(server_.Connect());
  std::unique_ptr<v1::StudyService::Stub> study_stub_ = v1::StudyService::NewStub(server_.Connect());
};

TEST_F(CalibrationHandlersTest, ACalibrationIsRecordedAndReadBack) {
  v1::CharacteriseAxisRequest request = AxisRequest("A");
  const auto made = Characterise(request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->state(), v1::CALIBRATION_STATE_IN_FORCE);
  EXPECT_THAT(made->inputs(), ElementsAre("machines/m1@3"));
  ASSERT_EQ(store_->entries().size(), 1u);
  const storage::RecordEntry entry = store_->entries().front().entry;
  EXPECT_EQ(entry.name, made->name());
  EXPECT_EQ(entry.method, "ENCODER_RUN");
  EXPECT_THAT(entry.requested_by, ::testing::StartsWith("ipv4:127.0.0.1:"));  // no certificate
  EXPECT_THAT(entry.summary_json, HasSubstr("reversal_deg"));
  EXPECT_EQ(Get(made->name())->SerializeAsString(), made->SerializeAsString());

  v1::ListCalibrationsRequest list;
  list.set_kind(v1::CALIBRATION_KIND_AXIS);
  const auto page = Call(*stub_, &Stub::ListCalibrations, list);
  ASSERT_EQ(page->calibrations_size(), 1);
  EXPECT_EQ(page->calibrations(0).axis().table().forward_error_deg_size(), 0);
}

TEST_F(CalibrationHandlersTest, ARetryGetsTheKeptAnswerWithoutAnyWork) {
  v1::CharacteriseAxisRequest request = AxisRequest("A");
  request.set_request_id(kSomeUuid);
  const auto first = Characterise(request);
  ASSERT_TRUE(first.ok()) << first.status();
  peers_.reset();  // work would fail
  EXPECT_EQ(Characterise(request)->SerializeAsString(), first->SerializeAsString());
  request.set_axis("B");
  EXPECT_EQ(Characterise(request).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(store_->entries().size(), 1u);
}

TEST_F(CalibrationHandlersTest, NothingIsRecordedOfWhatIsRefused) {
  v1::CharacteriseAxisRequest request = AxisRequest("Z");
  EXPECT_THAT(std::string(Characterise(request).status().message()), HasSubstr("axis: Z, want a rotary axis"));
  request = AxisRequest("A");
  request.set_machine("machines/m9");
  EXPECT_EQ(Characterise(request).status().code(), absl::StatusCode::kInvalidArgument);
  v1::CalibrateRotationRequest rotation = RotationRequest();
  rotation.mutable_poses(1)->clear_centre_mm();
  EXPECT_THAT(std::string(Rotate(rotation).status().message()), HasSubstr("poses[1].centre_mm"));
  rotation = RotationRequest();
  rotation.set_apply_axis_tables(true);
  EXPECT_EQ(runtime::ReasonOf(Rotate(rotation).status()), "AXIS_NOT_CHARACTERISED");
  EXPECT_TRUE(store_->entries().empty());
}

TEST_F(CalibrationHandlersTest, ADraftIsReleasedAndTheOneBeforeWithdrawn) {
  v1::CalibrateRotationRequest request = RotationRequest();
  const auto before = Rotate(request);
  ASSERT_TRUE(before.ok()) << before.status();
  request.set_draft(true);
  const auto draft = Rotate(request);
  EXPECT_EQ(draft->state(), v1::CALIBRATION_STATE_DRAFT);
  v1::ReleaseCalibrationRequest release;
  release.set_name(draft->name());
  const auto released = Call(*stub_, &Stub::ReleaseCalibration, release);
  EXPECT_EQ(released->state(), v1::CALIBRATION_STATE_IN_FORCE);
  EXPECT_EQ(Get(before->name())->superseded_by(), draft->name());
  EXPECT_EQ(runtime::ReasonOf(Call(*stub_, &Stub::ReleaseCalibration, release).status()), "CALIBRATION_NOT_A_DRAFT");

  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(before->name());
  EXPECT_THAT(std::string(Call(*stub_, &Stub::WithdrawCalibration, withdraw).status().message()), HasSubstr("reason"));
  withdraw.set_reason("sensor was knocked");
  const auto withdrawn = Call(*stub_, &Stub::WithdrawCalibration, withdraw);
  EXPECT_EQ(withdrawn->calibration().state(), v1::CALIBRATION_STATE_WITHDRAWN);
  EXPECT_EQ(withdrawn->in_force(), draft->name());
  EXPECT_EQ(withdrawn->resting_count(), 0);
  withdraw.set_name(std::string("calibrations/") + kSomeUuid);
  EXPECT_EQ(runtime::ReasonOf(Call(*stub_, &Stub::WithdrawCalibration, withdraw).status()), "CALIBRATION_NOT_FOUND");
}

TEST_F(CalibrationHandlersTest, SaysWhyNoneIsInForce) {
  v1::GetCalibrationInForceRequest get;
  get.set_machine("machines/m1");
  get.set_kind(v1::CALIBRATION_KIND_ROTATION);
  const auto reason = [&] { return runtime::ReasonOf(Call(*stub_, &Stub::GetCalibrationInForce, get).status()); };
  EXPECT_EQ(reason(), "CALIBRATION_MISSING");
  v1::CalibrateRotationRequest request = RotationRequest();
  request.mutable_valid_from()->set_seconds(1'500'000'000);
  request.mutable_valid_until()->set_seconds(1'500'000'001);
  ASSERT_TRUE(Rotate(request).ok());
  EXPECT_EQ(reason(), "CALIBRATION_EXPIRED");
  request.clear_valid_from();
  request.clear_valid_until();
  const auto made = Rotate(request);
  EXPECT_EQ(Call(*stub_, &Stub::GetCalibrationInForce, get)->name(), made->name());
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(made->name());
  withdraw.set_reason("sensor was knocked");
  ASSERT_TRUE(Call(*stub_, &Stub::WithdrawCalibration, withdraw).ok());
  EXPECT_EQ(reason(), "CALIBRATION_WITHDRAWN");

  v1::GetCalibrationTrendRequest trend;
  trend.set_machine("machines/m1");
  trend.set_kind(v1::CALIBRATION_KIND_ROTATION);
  EXPECT_EQ(Call(*stub_, &Stub::GetCalibrationTrend, trend)->parameters(0).points_size(), 1);
  trend.set_kind(v1::CALIBRATION_KIND_SENSOR);
  EXPECT_EQ(runtime::ReasonOf(Call(*stub_, &Stub::GetCalibrationTrend, trend).status()), "CALIBRATION_MISSING");
}

// Whatever the clock of the computer that this service runs on says.
TEST_F(CalibrationHandlersTest, ValidityCountsByTheClockOfTheStore) {
  v1::CalibrateRotationRequest request = RotationRequest();
  const auto made = Rotate(request);
  ASSERT_TRUE(made.ok()) << made.status();
  request.set_draft(true);
  const auto draft = Rotate(request);
  ASSERT_TRUE(draft.ok()) << draft.status();
  v1::GetCalibrationInForceRequest get;
  get.set_machine("machines/m1");
  get.set_kind(v1::CALIBRATION_KIND_ROTATION);
  EXPECT_EQ(Call(*stub_, &Stub::GetCalibrationInForce, get)->name(), made->name());
  store_->SetClockAhead(std::chrono::hours(31 * 24));
  EXPECT_EQ(runtime::ReasonOf(Call(*stub_, &Stub::GetCalibrationInForce, get).status()), "CALIBRATION_EXPIRED");
  EXPECT_EQ(Get(made->name())->state(), v1::CALIBRATION_STATE_EXPIRED);
  v1::ReleaseCalibrationRequest release;
  release.set_name(draft->name());
  release.set_reason("checked");
  EXPECT_EQ(runtime::ReasonOf(Call(*stub_, &Stub::ReleaseCalibration, release).status()), "CALIBRATION_EXPIRED");
  request.set_draft(false);
  const auto later = Rotate(request);
  ASSERT_TRUE(later.ok()) << later.status();
  EXPECT_GT(later->valid_from().seconds(), made->valid_from().seconds() + 30 * 24 * 3600);
  EXPECT_EQ(Call(*stub_, &Stub::GetCalibrationInForce, get)->name(), later->name());
}

TEST_F(CalibrationHandlersTest, AStudyIsRecordedOnceAndReadBack) {
  v1::RunGaugeRrRequest request;
  request.set_outer_name("part");
  request.set_inner_name("person");
  request.set_unit("um");
  request.set_machine("machines/m1");
  request.set_request_id(kSomeUuid);
  for (int i = 0; i < 8; ++i) {
    v1::Observation* o = request.add_observations();
    o->set_outer(std::to_string(i / 4));
    o->set_inner(std::to_string(i / 2));
    o->set_value(i * i);
  }
  const auto made = Call(*study_stub_, &v1::StudyService::Stub::RunGaugeRr, request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_THAT(made->inputs(), ElementsAre("machines/m1@3"));
  EXPECT_EQ(Call(*study_stub_, &v1::StudyService::Stub::RunGaugeRr, request)->name(), made->name());
  ASSERT_EQ(studies_->rows().size(), 1u);
  EXPECT_EQ(studies_->entries().front().method, "GAUGE_RR");
  v1::GetStudyRequest get;
  get.set_name(made->name());
  EXPECT_EQ(Call(*study_stub_, &v1::StudyService::Stub::GetStudy, get)->SerializeAsString(), made->SerializeAsString());
  v1::RunRepeatStudyRequest repeat;
  for (int i = 0; i < 3; ++i) repeat.add_calibrations("calibrations/" + storage::NewUuid());
  EXPECT_THAT(std::string(Call(*study_stub_, &v1::StudyService::Stub::RunRepeatStudy, repeat).status().message()),
              HasSubstr("want one that is recorded"));
}

TEST_F(CalibrationHandlersTest, ADamagedRowIsDataLossAndNeverLess) {
  const auto made = Characterise(AxisRequest("A"));
  ASSERT_TRUE(made.ok()) << made.status();
  storage::CalibrationRow row = **store_->Find(made->name().substr(std::string("calibrations/").size()), {});
  ASSERT_TRUE(ToProto(row).ok());
  for (const char* judgements :
       {"{", "{}", R"([1])", R"([{"of": 1, "agrees": true}])", R"([{"of": "a", "agrees": 1}])"}) {
    row.judgements_json = judgements;
    EXPECT_EQ(ToProto(row).status().code(), absl::StatusCode::kDataLoss) << judgements;
  }
  row.judgements_json.clear();
  row.sensor.emplace().machine_from_sensor_rotation.resize(9);
  row.sensor->t_sm_mm.resize(3);
  row.sensor->covariance.resize(36);
  EXPECT_TRUE(ToProto(row).ok());
  row.sensor->arm_shares_json = R"([{"series": "s"}])";
  EXPECT_THAT(std::string(ToProto(row).status().message()), HasSubstr("arm shares cannot be read"));
  row.sensor->arm_shares_json.clear();
  row.sensor->travel = "SIDEWAYS";
  EXPECT_EQ(ToProto(row).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(CalibrationHandlersTest, SaysWhatTheStoreSays) {
  store_->Fail(absl::UnavailableError("database: away"));
  EXPECT_EQ(Characterise(AxisRequest("A")).status().code(), absl::StatusCode::kUnavailable);
  const std::string name = std::string("calibrations/") + kSomeUuid;
  EXPECT_EQ(Get(name).status().code(), absl::StatusCode::kUnavailable);
  store_->Fail(absl::OkStatus());
  EXPECT_EQ(runtime::ReasonOf(Get(name).status()), "CALIBRATION_NOT_FOUND");
  EXPECT_THAT(std::string(Get("scans/s1").status().message()), HasSubstr("name: scans/s1"));
}

}  // namespace
}  // namespace sixpoint::calibration
