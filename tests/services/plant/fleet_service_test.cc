// The service over real gRPC on a real PostgreSQL, and what it says of rows that a test makes up.
#include "services/plant/fleet_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "services/plant/fleet_alarms.h"
#include "services/plant/fleet_state.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/time_proto.h"
#include "sixpoint/ingest/v1/scan.pb.h"
#include "storage/scan_uploads.h"
#include "tests/support/customers_parts.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::plant {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using storage::Instant;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

std::vector<v1::AlarmKind> KindsOf(const std::vector<v1::MachineAlarm>& alarms) {
  std::vector<v1::AlarmKind> kinds;
  for (const v1::MachineAlarm& alarm : alarms) kinds.push_back(alarm.kind());
  return kinds;
}

// A machine with which nothing is wrong; each test spoils one thing.
class Alarms : public ::testing::Test {
 protected:
  Alarms() {
    for (const char* kind : {"sensor", "rotation"}) {
      storage::MachineCalibrationRow& row = calibrations_.emplace_back();
      row.calibration_id = kind;
      row.kind = kind;
      row.recorded_at = row.valid_from = now_ - hours(24);
      row.valid_until = now_ + hours(24 * 30);
      row.in_force = true;
    }
    contact_.kind = "scan";
    contact_.recorded_at = now_ - minutes(5);
    contact_.run_count = 1;
    state_.set_machine("machines/m1");
  }
  std::vector<v1::AlarmKind> Kinds() {
    MachineRows rows;
    rows.contacts = {&contact_};
    for (const storage::MachineCalibrationRow& row : calibrations_) rows.calibrations.push_back(&row);
    if (upload_.block_count > 0) rows.uploads = {&upload_};
    rows.work = &work_;
    return KindsOf(AlarmsOf(rows, state_, now_));
  }
  const Instant now_ = std::chrono::system_clock::now();
  std::vector<storage::MachineCalibrationRow> calibrations_;
  storage::ContactRow contact_;
  storage::UploadInProgressRow upload_;
  storage::MachineWorkRow work_;
  v1::MachineState state_;
};

TEST_F(Alarms, NoneWhereNothingIsWrong) { EXPECT_THAT(Kinds(), IsEmpty()); }

TEST_F(Alarms, OfCalibrations) {
  calibrations_[0].valid_until = now_ + hours(24 * 7) - minutes(1);
  EXPECT_THAT(Kinds(), ElementsAre(v1::ALARM_KIND_CALIBRATION_EXPIRES));
  calibrations_[0].valid_until = now_ - minutes(1);
  calibrations_[0].in_force = false;
  EXPECT_THAT(Kinds(), ElementsAre(v1::ALARM_KIND_CALIBRATION_EXPIRED));
  calibrations_[1].drift = storage::DriftRow{"earlier", "point_c_x_mm", 0.02, 4.5, {"point_c_x_mm"}};
  EXPECT_THAT(Kinds(), ElementsAre(v1::ALARM_KIND_CALIBRATION_EXPIRED, v1::ALARM_KIND_DRIFT));
  calibrations_[1].drift->flagged_parameters = {};
  calibrations_.erase(calibrations_.begin());
  EXPECT_THAT(Kinds(), ElementsAre(v1::ALARM_KIND_NOT_CALIBRATED));
}

TEST_F(Alarms, AScannerThatMovedComesFirst) {
  calibrations_[0].standing_check_id = "check";
  calibrations_[0].standing_check_at = now_ - hours(1);
  work_.awaiting_count = 2;
  work_.first_awaiting_id = "c";
  EXPECT_THAT(Kinds(), ElementsAre(v1::ALARM_KIND_SENSOR_MOVED, v1::ALARM_KIND_CORRECTION_AWAITS));
}

TEST_F(Alarms, OfVerdicts) {
  contact_.kind = "inspection";
  contact_.detail = "NOT_CONFORM";
  contact_.run_count = 2;
  EXPECT_THAT(Kinds(), Not(Contains(v1::ALARM_KIND_NOT_CONFORM_IN_A_ROW)));
  contact_.run_count = 3;
  EXPECT_THAT(Kinds(), Contains(v1::ALARM_KIND_NOT_CONFORM_IN_A_ROW));
  v1::Yield* yield = state_.mutable_yield();
  yield->set_conform_count(15);
  yield->set_not_conform_count(4);
  yield->set_conform_share(15.0 / 19);
  EXPECT_THAT(Kinds(), Not(Contains(v1::ALARM_KIND_YIELD_LOW))) << "too few to say";
  yield->set_not_measured_count(1);
  yield->set_conform_share(15.0 / 20);
  EXPECT_THAT(Kinds(), Contains(v1::ALARM_KIND_YIELD_LOW));
}

TEST_F(Alarms, OfSilence) {
  contact_.recorded_at = now_ - hours(25);
  EXPECT_THAT(Kinds(), ElementsAre(v1::ALARM_KIND_SILENT));
  upload_.block_count = 3;
  upload_.touched_at = now_ - minutes(9);
  EXPECT_THAT(Kinds(), IsEmpty()) << "a block was heard of";
  upload_.touched_at = now_ - minutes(11);
  EXPECT_THAT(Kinds(), ElementsAre(v1::ALARM_KIND_UPLOAD_STALLED));
}

TEST(StepTimes, AQuantileIsTheMiddleOfItsBucket) {
  // Bucket 33 is 256 s to 304 s.
  EXPECT_NEAR(QuantileOf({{33, 10}}, 0.5), 279, 1);
  EXPECT_NEAR(QuantileOf({{33, 94}, {41, 6}}, 0.95), 4 * 279, 4);
  EXPECT_NEAR(QuantileOf({{33, 95}, {41, 5}}, 0.95), 279, 1);
}

class FleetServiceTest : public ::testing::Test {
 protected:
  FleetServiceTest()
      : service_(storage::FleetIn(database_.database()), storage::ClearancesIn(database_.database())),
        server_({&service_}),
        stub_(v1::FleetService::NewStub(server_.Connect())) {}

  void SetUp() override {
    const auto calibrations = testing::PutCalibratedMachine(database_.database());
    testing::PutCustomersPart(database_.database(), "open", false, calibrations);
    secret_ = testing::PutCustomersPart(database_.database(), "secret", true, calibrations);
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(testing::Soon());
    testing::RegisterMachine(*transaction, "m2");
    storage::ScanUploadRow upload;
    for (const std::string subject : {"blades/open-sn", "blades/secret-sn"}) {
      ingest::v1::ScanHeader header;
      header.set_scan_id("on-its-way-" + subject.substr(7));
      header.set_machine("machines/m1");
      header.set_subject(subject);
      upload.scan_id = header.scan_id();
      upload.header = header.SerializeAsString();
      upload.machine_revision = 1;
      ASSERT_TRUE(storage::BeginUpload(*transaction, upload).ok());
    }
    ASSERT_TRUE(transaction->Commit().ok());
  }
  absl::StatusOr<v1::ListMachineStatesResponse> List(const v1::ListMachineStatesRequest& request) {
    v1::ListMachineStatesResponse response;
    const auto context = runtime::ContextFor(20.0);
    const absl::Status status = runtime::FromGrpc(stub_->ListMachineStates(context.get(), request, &response));
    if (!status.ok()) return status;
    return response;
  }
  testing::ThrowawayDatabase database_;
  FleetService service_;
  testing::InProcessServer server_;
  std::unique_ptr<v1::FleetService::Stub> stub_;
  testing::CustomersPart secret_;
};

TEST_F(FleetServiceTest, MachinesWithWhatTheyDid) {
  const auto all = List({});
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_EQ(all->machines_size(), 2);
  const v1::MachineState& busy = all->machines(0);
  EXPECT_EQ(busy.machine(), "machines/m1");
  EXPECT_EQ(busy.throughput().scan_count(), 2);
  EXPECT_EQ(busy.throughput().inspection_count(), 2);
  EXPECT_EQ(busy.calibrations_size(), 2);
  EXPECT_TRUE(busy.calibrations(0).in_force());
  EXPECT_EQ(busy.last_contact_by(), "upload");
  const v1::MachineState& idle = all->machines(1);
  EXPECT_FALSE(idle.has_last_contact());
  EXPECT_EQ(idle.throughput().scan_count(), 0);
  EXPECT_FALSE(idle.yield().has_conform_share());
  EXPECT_EQ(idle.alarms(0).kind(), v1::ALARM_KIND_NOT_CALIBRATED);
}

TEST_F(FleetServiceTest, PagesByIdHoldAllMachines) {
  v1::ListMachineStatesRequest request;
  request.set_page_size(1);
  const auto first = List(request);
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_EQ(first->machines_size(), 1);
  request.set_page_token(first->next_page_token());
  const auto second = List(request);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->machines(0).machine(), "machines/m2");
  EXPECT_EQ(second->next_page_token(), "");
}

TEST_F(FleetServiceTest, NamesOfAPartThatIsHiddenAreLeftOut) {
  // Without a certificate the caller is nobody, to whom a customer's part is hidden.
  const auto all = List({});
  ASSERT_TRUE(all.ok()) << all.status();
  EXPECT_THAT(all->ShortDebugString(), Not(::testing::HasSubstr("secret")));
  EXPECT_THAT(all->ShortDebugString(), ::testing::HasSubstr("on-its-way-open-sn"));
  EXPECT_EQ(all->machines(0).uploads_size(), 2) << "that it is busy is told";
}

TEST_F(FleetServiceTest, ASpanIsWidenedAndBounded) {
  v1::ListMachineStatesRequest request;
  const Instant now = std::chrono::system_clock::now();
  runtime::ToProto(now - hours(3 * 24), request.mutable_span()->mutable_from());
  const auto days = List(request);
  ASSERT_TRUE(days.ok()) << days.status();
  EXPECT_EQ(days->counted_from().seconds() % 86400, 0);
  EXPECT_EQ(days->machines(0).throughput().scan_count(), 2);
  runtime::ToProto(now - hours(401 * 24), request.mutable_span()->mutable_from());
  EXPECT_EQ(List(request).status().code(), absl::StatusCode::kInvalidArgument);
  runtime::ToProto(now + hours(1), request.mutable_span()->mutable_from());
  EXPECT_EQ(List(request).status().code(), absl::StatusCode::kInvalidArgument) << "turned round";
}

TEST_F(FleetServiceTest, HoursOfOneMachine) {
  v1::GetMachineActivityRequest request;
  request.set_machine("machines/m1");
  v1::MachineActivity activity;
  const auto context = runtime::ContextFor(20.0);
  ASSERT_TRUE(stub_->GetMachineActivity(context.get(), request, &activity).ok());
  std::int64_t scans = 0;
  for (const v1::ActivityHour& hour : activity.hours()) {
    EXPECT_EQ(hour.begins_at().seconds() % 3600, 0);
    scans += hour.throughput().scan_count();
  }
  EXPECT_EQ(scans, 2);
}

TEST_F(FleetServiceTest, AMachineThatDidNothingHasNoHoursAndOneThatIsUnknownIsRefused) {
  const auto ask = [&](const char* machine, v1::MachineActivity* activity) {
    v1::GetMachineActivityRequest request;
    request.set_machine(machine);
    runtime::ToProto(std::chrono::system_clock::now() - hours(30 * 24), request.mutable_span()->mutable_from());
    runtime::ToProto(std::chrono::system_clock::now() - hours(29 * 24), request.mutable_span()->mutable_until());
    const auto context = runtime::ContextFor(20.0);
    return runtime::FromGrpc(stub_->GetMachineActivity(context.get(), request, activity));
  };
  v1::MachineActivity idle, none;
  const absl::Status known = ask("machines/m2", &idle);
  EXPECT_TRUE(known.ok()) << known;
  EXPECT_EQ(idle.hours_size(), 0);
  EXPECT_EQ(runtime::ReasonOf(ask("machines/nowhere", &none)), "MACHINE_NOT_FOUND");
}

}  // namespace
}  // namespace sixpoint::plant
