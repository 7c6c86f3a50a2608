// The handlers of machining passes on fake stores: no PostgreSQL, and no surface is looked at.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "services/correction/machining_pass_service.h"
#include "services/runtime/time_proto.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/call.h"
#include "tests/support/fake_machining_passes.h"
#include "tests/support/fake_reconstructions.h"
#include "tests/support/fake_repairs.h"
#include "tests/support/listed_results.h"
#include "tests/support/must.h"
#include "tests/support/sample_results.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::correction {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsNan;
using ::testing::SizeIs;

constexpr storage::Instant kCutAt{std::chrono::seconds(1'714'561'601)};

class MachiningPassHandlersTest : public ::testing::Test {
 protected:
  using Row = storage::MachiningPassRow;
  using Stub = v1::MachiningPassService::Stub;
  using Corrections = testing::FakeResults<storage::CorrectionRow, storage::CorrectionFilter>;

  // The registration's scans came an hour after the cut.
  MachiningPassHandlersTest() {
    runtime::ToProto(kCutAt + std::chrono::hours(1), plant_.registration.registration.mutable_scans_received_at());
  }
  static Row Sample() {
    Row row = testing::SampleMachiningPass();
    row.blade_serial = "sn1";
    row.part_id = "p1";
    row.registration_id = std::string(testing::kRegistration).substr(14);
    row.correction_id = row.reconstruction_id = kSomeUuid;
    row.scan_ids = {"s0", "s1"};
    return row;
  }
  // As if the request had been answered with it; gives its name.
  std::string Put(Row row = Sample(), const v1::NextPassRequest& request = {}) {
    row.pass_id = storage::NewUuid();
    testing::Must(store_->Record(runtime::RecordedRequestOf("correction.NextPass", request, ""), row, {}, {}).status());
    return "machining_passes/" + row.pass_id;
  }
  // Of a blade whose one hole was reported cut, by a shape that is not recorded.
  static storage::CorrectionRow Cut() {
    storage::CorrectionRow row;
    row.blade_serial = "sn1";
    row.machine_id = "m1";
    row.part_id = "p1";
    row.part_revision = 1;
    row.reconstruction_id = kSomeUuid;
    storage::CorrectionGroupRow& group = row.groups.emplace_back();
    group.group_name = "edge";
    group.holes.emplace_back().hole_name = "E1";
    group.holes.back().reported_cut_at = kCutAt;
    return row;
  }
  // Recorded, as a request of the pass after it names it.
  v1::NextPassRequest RequestAfter(storage::CorrectionRow row, const std::string& request_id = "") {
    row.correction_id = storage::NewUuid();
    testing::Must(corrections_->Record({}, row, {}, {}).status());
    v1::NextPassRequest request;
    request.set_correction("corrections/" + row.correction_id);
    request.set_registration(testing::kRegistration);
    request.set_request_id(request_id);
    return request;
  }
  absl::StatusOr<v1::MachiningPass> Next(const v1::NextPassRequest& request) {
    return testing::Call(*stub_, &Stub::NextPass, request);
  }
  absl::StatusOr<v1::MachiningPass> Get(const std::string& name) {
    v1::GetMachiningPassRequest request;
    request.set_name(name);
    return testing::Call(*stub_, &Stub::GetMachiningPass, request);
  }
  absl::StatusOr<v1::ListMachiningPassesResponse> List(const v1::ListMachiningPassesRequest& request) {
    return testing::Call(*stub_, &Stub::ListMachiningPasses, request);
  }
  testing::Streamed<v1::BlankPatches> Patches(const std::string& name) {
    v1::DownloadPassPatchesRequest request;
    request.set_name(name);
    return testing::CallStream(*stub_, &Stub::DownloadPassPatches, request);
  }
  // Of every handler that is given a name.
  std::vector<absl::Status> StatusesOf(const std::string& name) {
    v1::ReplayMachiningPassRequest replay;
    replay.set_name(name);
    return {Get(name).status(), Patches(name).status,
            testing::Call(*stub_, &Stub::ReplayMachiningPass, replay).status()};
  }

  testing::StandIns plant_;
  std::shared_ptr<testing::FakeMachiningPasses> store_ = std::make_shared<testing::FakeMachiningPasses>();
  std::shared_ptr<testing::FakeReconstructions> reconstructions_ = std::make_shared<testing::FakeReconstructions>();
  std::shared_ptr<Corrections> corrections_ =
      std::make_shared<Corrections>(&storage::CorrectionRow::correction_id,
                                    [](const storage::CorrectionRow& row, const storage::CorrectionFilter& filter) {
                                      return testing::IsListed(row, filter);
                                    });
  MachiningPassService service_{
      {reconstructions_, store_, std::make_shared<testing::FakeRepairs>()},
      corrections_,
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {1, 0},
      1};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::MachiningPassService::NewStub(server_.Connect());
};

TEST_F(MachiningPassHandlersTest, APassIsReadByItsName) {
  Put();
  const std::string name = Put();
  const auto pass = Get(name);
  ASSERT_TRUE(pass.ok()) << pass.status();
  EXPECT_EQ(pass->name(), name);
  EXPECT_EQ(pass->blade(), "blades/sn1");
  EXPECT_EQ(pass->correction(), std::string("corrections/") + kSomeUuid);
  EXPECT_EQ(pass->reconstruction(), std::string("reconstructions/") + kSomeUuid);
  EXPECT_THAT(pass->scans(), ElementsAre("scans/s0", "scans/s1"));
  EXPECT_EQ(pass->record_sequence(), 2);
  EXPECT_EQ(pass->outcome(), v1::MACHINING_PASS_OUTCOME_DONE);
  EXPECT_FALSE(pass->has_greatest_rest_mm());
  ASSERT_THAT(pass->regions(), SizeIs(1));
  EXPECT_EQ(pass->regions(0).region(), "edge");
  EXPECT_EQ(pass->regions(0).greatest_rest_um(), 3);
  EXPECT_EQ(pass->regions(0).deflection_share(), 0.2);
}

TEST_F(MachiningPassHandlersTest, ListsByPagesNewestFirstAndByWhatIsAskedFor) {
  Row other = Sample();
  other.blade_serial = "sn2";
  other.outcome = "SCRAP";
  other.remark = "the edge is cut too deep";
  const std::vector<std::string> names = {Put(), Put(other), Put(), Put(), Put()};
  testing::ExpectPagesNewestFirst<v1::ListMachiningPassesRequest>(
      names, [this](const auto& request) { return List(request); },
      [](const auto& page) { return page.machining_passes(); });
  v1::ListMachiningPassesRequest request;
  request.set_blade("blades/sn2");
  EXPECT_THAT(testing::ListedNames(List(request)->machining_passes()), ElementsAre(names[1]));
  request.clear_blade();
  request.set_outcome(v1::MACHINING_PASS_OUTCOME_SCRAP);
  EXPECT_THAT(testing::ListedNames(List(request)->machining_passes()), ElementsAre(names[1]));
  request.set_outcome(v1::MACHINING_PASS_OUTCOME_ANOTHER_PASS);
  EXPECT_THAT(List(request)->machining_passes(), IsEmpty());
}

TEST_F(MachiningPassHandlersTest, AListLeavesTheRegionsOutUnlessTheWholeIsAskedFor) {
  const std::string name = Put();
  v1::ListMachiningPassesRequest request;
  const auto basic = List(request);
  ASSERT_TRUE(basic.ok()) << basic.status();
  ASSERT_THAT(basic->machining_passes(), SizeIs(1));
  EXPECT_THAT(basic->machining_passes(0).regions(), IsEmpty());
  EXPECT_EQ(basic->machining_passes(0).outcome(), v1::MACHINING_PASS_OUTCOME_DONE);
  request.set_view(list::v1::VIEW_FULL);
  const auto full = List(request);
  ASSERT_TRUE(full.ok()) << full.status();
  EXPECT_EQ(full->machining_passes(0).DebugString(), Get(name)->DebugString());
}

TEST_F(MachiningPassHandlersTest, AListRefusesEachFieldByItsName) {
  testing::ExpectListRefusals<v1::ListMachiningPassesRequest>([this](const auto& request) { return List(request); });
  v1::ListMachiningPassesRequest request;
  request.set_outcome(static_cast<v1::MachiningPassOutcome>(99));
  EXPECT_EQ(testing::RefusedField(List(request).status()), "outcome");
}

TEST_F(MachiningPassHandlersTest, PatchesAreStreamedInTheirOrder) {
  Row row = Sample();
  row.patches = {{1, 2, 3, 4, 5, 6}, {0, 0, 1, 0, 1, 0}, {2, 2.5}, {60.5, NAN}, {0, 1}};
  const auto streamed = Patches(Put(row));
  ASSERT_TRUE(streamed.status.ok()) << streamed.status;
  ASSERT_THAT(streamed.messages, SizeIs(1));
  const v1::BlankPatches& patches = streamed.messages.front();
  EXPECT_THAT(patches.points_in_part_mm(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(patches.normals_in_part(), ElementsAre(0, 0, 1, 0, 1, 0));
  EXPECT_THAT(patches.expanded_uncertainties_um(), ElementsAre(2, 2.5));
  EXPECT_THAT(patches.stock_um(), ElementsAre(60.5, IsNan()));
  EXPECT_THAT(patches.regions(), ElementsAre(0, 1));
}

TEST_F(MachiningPassHandlersTest, WhatIsNotRecordedIsNotFoundAndOtherNamesAreRefused) {
  Put();
  const std::string name = std::string("machining_passes/") + kSomeUuid;
  for (const absl::Status& status : StatusesOf(name)) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
    EXPECT_EQ(runtime::ReasonOf(status), "MACHINING_PASS_NOT_FOUND");
    EXPECT_EQ(runtime::MetadataOf(status)["resource"], name);
  }
  for (const absl::Status& status : StatusesOf(std::string("corrections/") + kSomeUuid))
    EXPECT_EQ(testing::RefusedField(status), "name");
}

TEST_F(MachiningPassHandlersTest, SaysWhatTheStoresSay) {
  const std::string name = Put();
  const v1::NextPassRequest request = RequestAfter(Cut());
  corrections_->Fail(absl::ResourceExhaustedError("database: full"));
  EXPECT_EQ(Next(request).status().code(), absl::StatusCode::kResourceExhausted);
  store_->Fail(absl::DeadlineExceededError("database: slow"));
  std::vector<absl::Status> statuses = StatusesOf(name);
  statuses.push_back(List({}).status());
  statuses.push_back(Next(request).status());
  for (const absl::Status& status : statuses) EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded) << status;
}

TEST_F(MachiningPassHandlersTest, AWordThatThisReleaseDoesNotKnowIsDataLoss) {
  Row row = Sample();
  row.outcome = "ALMOST";
  EXPECT_EQ(Get(Put(row)).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(MachiningPassHandlersTest, ARetryGetsWhatTheFirstCallRecordedWithoutAnyWork) {
  v1::NextPassRequest request = RequestAfter(Cut(), kSomeUuid);
  const std::string name = Put(Sample(), request);
  const auto again = Next(request);  // its shape is in no store: work would fail
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->DebugString(), Get(name)->DebugString());
  EXPECT_THAT(store_->rows(), SizeIs(1));
  request.set_greatest_rest_mm(0.1);
  EXPECT_EQ(Next(request).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(MachiningPassHandlersTest, RefusesEachFieldByItsName) {
  const auto field = [&](const std::function<void(v1::NextPassRequest*)>& spoil) {
    v1::NextPassRequest request = RequestAfter(Cut());
    spoil(&request);
    return testing::RefusedField(Next(request).status());
  };
  using R = v1::NextPassRequest;
  EXPECT_EQ(field([](R* r) { r->set_correction("scans/s0"); }), "correction");
  EXPECT_EQ(field([](R* r) { r->set_registration("scans/s0"); }), "registration");
  EXPECT_EQ(field([](R* r) { r->set_greatest_rest_mm(0); }), "greatest_rest_mm");
  EXPECT_EQ(field([](R* r) { r->set_greatest_rest_mm(std::nan("")); }), "greatest_rest_mm");
  EXPECT_THAT(store_->rows(), IsEmpty());
}

// What was scanned is what this cut left, all of it.
TEST_F(MachiningPassHandlersTest, OnlyWhatWasWhollyCutByAShapeAndScannedAfterItIsLookedAt) {
  const auto refusal = [&](const std::function<void(storage::CorrectionRow*)>& change) {
    storage::CorrectionRow row = Cut();
    change(&row);
    const absl::Status status = Next(RequestAfter(row)).status();
    return testing::RefusedField(status) + ": " + std::string(status.message());
  };
  using C = storage::CorrectionRow;
  EXPECT_THAT(refusal([](C* c) { c->reconstruction_id.clear(); }),
              ::testing::AllOf(::testing::StartsWith("correction:"), HasSubstr("is by no shape")));
  EXPECT_THAT(refusal([](C* c) { c->groups[0].holes[0].reported_cut_at.reset(); }),
              ::testing::AllOf(::testing::StartsWith("correction:"), HasSubstr("has not cut edge/E1")));
  EXPECT_THAT(refusal([](C* c) { c->blade_serial = "sn2"; }),
              ::testing::AllOf(::testing::StartsWith("registration:"), HasSubstr("want one of blades/sn2")));
  EXPECT_THAT(refusal([](C* c) { c->machine_id = "m2"; }),
              ::testing::AllOf(::testing::StartsWith("registration:"), HasSubstr("want one on machines/m2")));
  EXPECT_THAT(refusal([](C* c) { c->part_revision = 2; }),
              ::testing::AllOf(::testing::StartsWith("registration:"), HasSubstr("want one of revision 2")));
  EXPECT_THAT(refusal([](C* c) { c->groups[0].holes[0].reported_cut_at = kCutAt + std::chrono::hours(2); }),
              ::testing::AllOf(::testing::StartsWith("registration:"), HasSubstr("scans from before the cut")));
  EXPECT_THAT(plant_.ingest.downloads(), IsEmpty());
  EXPECT_THAT(store_->rows(), IsEmpty());
}

TEST_F(MachiningPassHandlersTest, WhatItRestsOnIsNotFoundByItsOwnReason) {
  v1::NextPassRequest request = RequestAfter(Cut());
  const absl::Status no_shape = Next(request).status();
  EXPECT_EQ(no_shape.code(), absl::StatusCode::kNotFound) << no_shape;
  EXPECT_EQ(runtime::ReasonOf(no_shape), "RECONSTRUCTION_NOT_FOUND");
  EXPECT_EQ(runtime::MetadataOf(no_shape)["resource"], std::string("reconstructions/") + kSomeUuid);
  request.set_correction(std::string("corrections/") + kSomeUuid);
  const absl::Status no_correction = Next(request).status();
  EXPECT_EQ(no_correction.code(), absl::StatusCode::kNotFound) << no_correction;
  EXPECT_EQ(runtime::ReasonOf(no_correction), "CORRECTION_NOT_FOUND");
  EXPECT_EQ(runtime::MetadataOf(no_correction)["resource"], request.correction());
}

TEST_F(MachiningPassHandlersTest, ALatticeThatCannotBeReadIsDataLoss) {
  storage::ReconstructionRow shape = testing::SampleReconstruction();  // whose lattice is a word
  shape.reconstruction_id = kSomeUuid;
  testing::Must(reconstructions_->Record({}, shape, {}, {}).status());
  EXPECT_EQ(Next(RequestAfter(Cut())).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(store_->rows(), IsEmpty());
}

}  // namespace
}  // namespace sixpoint::correction
