// The handlers of repairs on a fake store: no PostgreSQL, and no repair is planned.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "services/correction/repair_service.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/call.h"
#include "tests/support/fake_repairs.h"
#include "tests/support/listed_results.h"
#include "tests/support/must.h"
#include "tests/support/sample_results.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::correction {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class RepairHandlersTest : public ::testing::Test {
 protected:
  using Row = storage::RepairRow;
  using Stub = v1::RepairService::Stub;

  static Row Sample() {
    Row row = testing::SampleRepair();
    row.blade_serial = "sn1";
    row.machine_id = "m1";
    row.part_id = "p1";
    row.registration_id = std::string(testing::kRegistration).substr(14);
    row.scan_ids = {"s0", "s1"};
    return row;
  }
  // As if the request had been answered with it; gives its name.
  std::string Put(Row row = Sample(), const v1::PlanRepairRequest& request = {}) {
    row.repair_id = storage::NewUuid();
    testing::Must(
        store_->Record(runtime::RecordedRequestOf("correction.PlanRepair", request, ""), row, {}, {}).status());
    return "repairs/" + row.repair_id;
  }
  static v1::PlanRepairRequest Request(const std::string& request_id = "") {
    v1::PlanRepairRequest request;
    request.set_registration(testing::kRegistration);
    request.mutable_heights()->set_first_mm(2);
    request.mutable_heights()->set_repair_line_mm(30);
    request.mutable_heights()->set_target_mm(38);
    request.mutable_mill()->set_diameter_mm(6);
    request.mutable_mill()->set_length_mm(40);
    request.set_request_id(request_id);
    return request;
  }
  absl::StatusOr<v1::Repair> Plan(const v1::PlanRepairRequest& request) {
    return testing::Call(*stub_, &Stub::PlanRepair, request);
  }
  absl::StatusOr<v1::Repair> Get(const std::string& name) {
    v1::GetRepairRequest request;
    request.set_name(name);
    return testing::Call(*stub_, &Stub::GetRepair, request);
  }
  absl::StatusOr<v1::ListRepairsResponse> List(const v1::ListRepairsRequest& request) {
    return testing::Call(*stub_, &Stub::ListRepairs, request);
  }
  testing::Streamed<v1::TargetContour> Contours(const std::string& name) {
    v1::DownloadTargetContoursRequest request;
    request.set_name(name);
    return testing::CallStream(*stub_, &Stub::DownloadTargetContours, request);
  }
  testing::Streamed<v1::RepairLap> Path(const std::string& name) {
    v1::DownloadRepairPathRequest request;
    request.set_name(name);
    return testing::CallStream(*stub_, &Stub::DownloadRepairPath, request);
  }
  // Of every handler that is given a name.
  std::vector<absl::Status> StatusesOf(const std::string& name) {
    v1::ReplayRepairRequest replay;
    replay.set_name(name);
    return {Get(name).status(), Contours(name).status, Path(name).status,
            testing::Call(*stub_, &Stub::ReplayRepair, replay).status()};
  }

  testing::StandIns plant_;
  std::shared_ptr<testing::FakeRepairs> store_ = std::make_shared<testing::FakeRepairs>();
  RepairService service_{
      store_,
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {1, 0},
      1};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::RepairService::NewStub(server_.Connect());
};

TEST_F(RepairHandlersTest, ARepairIsReadByItsName) {
  Row polynomial = Sample();
  polynomial.applied.extrapolation = "POLYNOMIAL";
  polynomial.determination = storage::RepairDeterminationRow{0.99, 0.98, 0.97, 0.96};
  const std::string by_polynomials = Put(polynomial), name = Put();
  const auto repair = Get(name);
  ASSERT_TRUE(repair.ok()) << repair.status();
  EXPECT_EQ(repair->name(), name);
  EXPECT_EQ(repair->blade(), "blades/sn1");
  EXPECT_EQ(repair->registration(), testing::kRegistration);
  EXPECT_THAT(repair->scans(), ElementsAre("scans/s0", "scans/s1"));
  EXPECT_EQ(repair->record_sequence(), 2);
  EXPECT_EQ(repair->heights().repair_line_mm(), 30);
  EXPECT_EQ(repair->mill().diameter_mm(), 6);
  EXPECT_EQ(repair->method().extrapolation(), v1::REPAIR_EXTRAPOLATION_PROCESS_OF_DEVIATION);
  EXPECT_EQ(repair->method().greatest_uncertainty_um(), 50);
  EXPECT_FALSE(repair->has_determination());
  ASSERT_THAT(repair->sections(), SizeIs(1));
  EXPECT_EQ(repair->sections(0).kind(), v1::REPAIR_SECTION_KIND_TARGET);
  EXPECT_EQ(repair->sections(0).deepest_cut_um(), 0.4);
  EXPECT_EQ(repair->removal().deepest_in_target_um(), 0.4);
  EXPECT_EQ(Get(by_polynomials)->determination().trailing(), 0.96);
}

TEST_F(RepairHandlersTest, ListsByPagesNewestFirstAndByWhatIsAskedFor) {
  Row other = Sample();
  other.blade_serial = "sn2";
  other.machine_id = "m2";
  const std::vector<std::string> names = {Put(), Put(other), Put(), Put(), Put()};
  testing::ExpectPagesNewestFirst<v1::ListRepairsRequest>(
      names, [this](const auto& request) { return List(request); }, [](const auto& page) { return page.repairs(); });
  v1::ListRepairsRequest request;
  request.set_blade("blades/sn2");
  EXPECT_THAT(testing::ListedNames(List(request)->repairs()), ElementsAre(names[1]));
  request.clear_blade();
  request.set_machine("machines/m2");
  EXPECT_THAT(testing::ListedNames(List(request)->repairs()), ElementsAre(names[1]));
  request.set_part("parts/another");
  EXPECT_THAT(List(request)->repairs(), IsEmpty());
}

TEST_F(RepairHandlersTest, AListLeavesTheSectionsOutUnlessTheWholeIsAskedFor) {
  const std::string name = Put();
  v1::ListRepairsRequest request;
  const auto basic = List(request);
  ASSERT_TRUE(basic.ok()) << basic.status();
  ASSERT_THAT(basic->repairs(), SizeIs(1));
  EXPECT_THAT(basic->repairs(0).sections(), IsEmpty());
  EXPECT_EQ(basic->repairs(0).lap_count(), 2);
  request.set_view(list::v1::VIEW_FULL);
  const auto full = List(request);
  ASSERT_TRUE(full.ok()) << full.status();
  EXPECT_EQ(full->repairs(0).DebugString(), Get(name)->DebugString());
}

TEST_F(RepairHandlersTest, AListRefusesEachFieldByItsName) {
  testing::ExpectListRefusals<v1::ListRepairsRequest>([this](const auto& request) { return List(request); });
}

TEST_F(RepairHandlersTest, ContoursAndLapsAreStreamedOneByOneInTheirOrder) {
  Row row = Sample();
  row.contours = {{{1, 2, 38}, {8.5}, {-5}}, {{1, 2, 39, 4, 5, 39}, {8, 9}, {5, 0.5}}};
  row.laps = {{39, 0.25, {1, 2, 39}, {0, 0, 1}}, {38, 0, {1, 2, 38, 4, 5, 38}, {0, 0, 1, 0, 1, 0}}};
  const std::string name = Put(row);
  const auto contours = Contours(name);
  ASSERT_TRUE(contours.status.ok()) << contours.status;
  ASSERT_THAT(contours.messages, SizeIs(2));
  EXPECT_THAT(contours.messages[0].points_in_part_mm(), ElementsAre(1, 2, 38));
  EXPECT_THAT(contours.messages[0].expanded_uncertainties_um(), ElementsAre(8.5));
  EXPECT_THAT(contours.messages[0].rest_um(), ElementsAre(-5));
  EXPECT_THAT(contours.messages[1].points_in_part_mm(), ElementsAre(1, 2, 39, 4, 5, 39));
  const auto path = Path(name);
  ASSERT_TRUE(path.status.ok()) << path.status;
  ASSERT_THAT(path.messages, SizeIs(2));
  EXPECT_EQ(path.messages[0].z_mm(), 39);
  EXPECT_EQ(path.messages[0].allowance_mm(), 0.25);
  EXPECT_EQ(path.messages[1].z_mm(), 38);
  EXPECT_THAT(path.messages[1].centres_in_part_mm(), ElementsAre(1, 2, 38, 4, 5, 38));
  EXPECT_THAT(path.messages[1].axes_in_part(), ElementsAre(0, 0, 1, 0, 1, 0));
}

TEST_F(RepairHandlersTest, WhatIsNotRecordedIsNotFoundAndOtherNamesAreRefused) {
  Put();
  const std::string name = std::string("repairs/") + kSomeUuid;
  for (const absl::Status& status : StatusesOf(name)) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
    EXPECT_EQ(runtime::ReasonOf(status), "REPAIR_NOT_FOUND");
    EXPECT_EQ(runtime::MetadataOf(status)["resource"], name);
  }
  for (const absl::Status& status : StatusesOf(std::string("corrections/") + kSomeUuid))
    EXPECT_EQ(testing::RefusedField(status), "name");
}

TEST_F(RepairHandlersTest, SaysWhatTheStoreSays) {
  const std::string name = Put();
  store_->Fail(absl::ResourceExhaustedError("database: full"));
  std::vector<absl::Status> statuses = StatusesOf(name);
  statuses.push_back(List({}).status());
  statuses.push_back(Plan(Request()).status());
  for (const absl::Status& status : statuses) EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
}

TEST_F(RepairHandlersTest, AWordThatThisReleaseDoesNotKnowIsDataLoss) {
  Row row = Sample();
  row.sections.front().kind = "GUESSED";
  EXPECT_EQ(Get(Put(row)).status().code(), absl::StatusCode::kDataLoss);
  row = Sample();
  row.applied.extrapolation = "BY_HAND";
  EXPECT_EQ(Get(Put(row)).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(RepairHandlersTest, ARetryGetsWhatTheFirstCallRecordedWithoutAnyWork) {
  const std::string name = Put(Sample(), Request(kSomeUuid));
  plant_.registration.registration.set_name("registrations/gone");  // work would fail
  const auto again = Plan(Request(kSomeUuid));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->DebugString(), Get(name)->DebugString());
  EXPECT_THAT(store_->rows(), SizeIs(1));
  v1::PlanRepairRequest other = Request(kSomeUuid);
  other.mutable_mill()->set_diameter_mm(8);
  EXPECT_EQ(Plan(other).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(Plan(Request()).status().code(), absl::StatusCode::kNotFound) << "nothing is kept without an id";
}

TEST_F(RepairHandlersTest, RefusesEachFieldByItsNameAndRecordsNothing) {
  const auto field = [this](const std::function<void(v1::PlanRepairRequest*)>& spoil) {
    v1::PlanRepairRequest request = Request();
    spoil(&request);
    return testing::RefusedField(Plan(request).status());
  };
  using R = v1::PlanRepairRequest;
  EXPECT_EQ(field([](R* r) { r->set_registration("scans/s0"); }), "registration");
  EXPECT_EQ(field([](R* r) { r->clear_heights(); }), "heights");
  EXPECT_EQ(field([](R* r) { r->mutable_heights()->set_line_width_mm(0); }), "heights.line_width_mm");
  EXPECT_EQ(field([](R* r) { r->clear_mill(); }), "mill");
  EXPECT_EQ(field([](R* r) { r->mutable_mill()->set_diameter_mm(0.1); }), "mill.diameter_mm");
  EXPECT_EQ(field([](R* r) { r->mutable_method()->set_scallop_um(1000); }), "method.scallop_um");
  EXPECT_EQ(field([](R* r) { r->mutable_method()->set_extrapolation(static_cast<v1::RepairExtrapolation>(99)); }),
            "method.extrapolation");
  plant_.registration.registration.mutable_evidence()->set_outcome(registration::v1::OUTCOME_NOT_CONVERGED);
  EXPECT_EQ(runtime::ReasonOf(Plan(Request()).status()), "REGISTRATION_NOT_CONVERGED");
  EXPECT_THAT(plant_.ingest.downloads(), IsEmpty());
  EXPECT_THAT(store_->rows(), IsEmpty());
  EXPECT_THAT(store_->entries(), IsEmpty());
}

}  // namespace
}  // namespace sixpoint::correction
