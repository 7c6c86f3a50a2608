// The fleet service's handlers on fakes: no PostgreSQL. What counts as an alarm, and the summaries themselves, are in fleet_service_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/plant/fleet_service.h"
#include "services/runtime/errors.h"
#include "services/runtime/time_proto.h"
#include "sixpoint/ingest/v1/scan.pb.h"
#include "tests/support/call.h"
#include "tests/support/fake_fleet.h"
#include "tests/support/fake_plant_stores.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::plant {
namespace {

using sixpoint::testing::Call;
using std::chrono::hours;
using ::testing::HasSubstr;

class FleetHandlersTest : public ::testing::Test {
 protected:
  using Stub = v1::FleetService::Stub;
  FleetHandlersTest() {
    fleet_->rows.machine_ids = {"m1", "m2"};
    const storage::Instant hour(std::chrono::floor<hours>(std::chrono::system_clock::now().time_since_epoch()));
    fleet_->rows.activity = {{"m1", hour, "scan", 0, 2, 0}};
    fleet_->activity["m1"] = fleet_->rows.activity;
  }
  void OnItsWay(const std::string& scan, const std::string& subject) {
    storage::UploadInProgressRow upload;
    ingest::v1::ScanHeader header;
    header.set_machine("machines/m1");
    header.set_subject(subject);
    upload.scan_id = scan;
    upload.header = header.SerializeAsString();
    upload.started_at = upload.touched_at = std::chrono::system_clock::now();
    fleet_->rows.uploads.push_back(upload);
  }
  absl::StatusOr<v1::ListMachineStatesResponse> List(const v1::ListMachineStatesRequest& request = {}) {
    return Call(*stub_, &Stub::ListMachineStates, request);
  }

  std::shared_ptr<testing::FakeFleet> fleet_ = std::make_shared<testing::FakeFleet>();
  testing::FakePlantStores stores_;
  FleetService service_{fleet_, stores_.fake_clearances};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::FleetService::NewStub(server_.Connect());
};

TEST_F(FleetHandlersTest, PagesById) {
  v1::ListMachineStatesRequest request;
  request.set_page_size(1);
  const auto first = List(request);
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_EQ(first->machines_size(), 1);
  EXPECT_EQ(first->machines(0).machine(), "machines/m1");
  EXPECT_EQ(first->machines(0).throughput().scan_count(), 2);
  request.set_page_token(first->next_page_token());
  const auto second = List(request);
  ASSERT_TRUE(second.ok()) << second.status();
  ASSERT_EQ(second->machines_size(), 1);
  EXPECT_EQ(second->machines(0).machine(), "machines/m2");
  EXPECT_EQ(second->machines(0).throughput().scan_count(), 0);
  EXPECT_EQ(second->next_page_token(), "");
  request.set_machine("machines/m2");
  EXPECT_TRUE(absl::IsInvalidArgument(List(request).status())) << "a token of another question";
}

TEST_F(FleetHandlersTest, AnUploadIsToldWithoutNamesToWhomItsSubjectIsHidden) {
  stores_.fake_clearances->part_of["blades/open"] = "open";
  stores_.fake_clearances->part_of["blades/secret"] = "secret";
  stores_.fake_clearances->customers["secret"] = "kappa";
  OnItsWay("s-open", "blades/open");
  OnItsWay("s-secret", "blades/secret");
  const auto all = List();
  ASSERT_TRUE(all.ok()) << all.status();
  EXPECT_EQ(all->machines(0).uploads_size(), 2) << "that it is busy is told";
  EXPECT_THAT(all->ShortDebugString(), HasSubstr("scans/s-open"));
  EXPECT_THAT(all->ShortDebugString(), Not(HasSubstr("secret")));
}

TEST_F(FleetHandlersTest, ASpanIsWidenedAndBounded) {
  v1::ListMachineStatesRequest request;
  const auto now = std::chrono::system_clock::now();
  runtime::ToProto(now - hours(3 * 24), request.mutable_span()->mutable_from());
  EXPECT_EQ(List(request)->counted_from().seconds() % 86400, 0) << "by days";
  runtime::ToProto(now - hours(5), request.mutable_span()->mutable_from());
  EXPECT_EQ(List(request)->counted_from().seconds() % 3600, 0);
  for (const auto from : {now - hours(401 * 24), now + hours(1)}) {
    runtime::ToProto(from, request.mutable_span()->mutable_from());
    EXPECT_TRUE(absl::IsInvalidArgument(List(request).status()));
  }
}

TEST_F(FleetHandlersTest, HoursAreOfAMachineThatIsThere) {
  v1::GetMachineActivityRequest request;
  request.set_machine("machines/m1");
  const auto busy = Call(*stub_, &Stub::GetMachineActivity, request);
  ASSERT_TRUE(busy.ok()) << busy.status();
  ASSERT_EQ(busy->hours_size(), 1);
  EXPECT_EQ(busy->hours(0).throughput().scan_count(), 2);
  request.set_machine("machines/m2");
  EXPECT_EQ(Call(*stub_, &Stub::GetMachineActivity, request)->hours_size(), 0);
  request.set_machine("machines/nowhere");
  EXPECT_EQ(runtime::ReasonOf(Call(*stub_, &Stub::GetMachineActivity, request).status()), "MACHINE_NOT_FOUND");
  request.set_machine("blades/b");
  EXPECT_TRUE(absl::IsInvalidArgument(Call(*stub_, &Stub::GetMachineActivity, request).status()));
}

TEST_F(FleetHandlersTest, SaysWhatTheStoreSays) {
  OnItsWay("s", "blades/open");
  fleet_->rows.uploads.back().header = "\xff";
  EXPECT_TRUE(absl::IsDataLoss(List().status()));
  fleet_->failure = absl::UnavailableError("database: away");
  EXPECT_TRUE(absl::IsUnavailable(List().status()));
  v1::GetMachineActivityRequest request;
  request.set_machine("machines/m1");
  EXPECT_TRUE(absl::IsUnavailable(Call(*stub_, &Stub::GetMachineActivity, request).status()));
}

}  // namespace
}  // namespace sixpoint::plant
