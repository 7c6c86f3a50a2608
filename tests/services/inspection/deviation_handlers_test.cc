// The handlers of deviation maps on a fake store: no PostgreSQL, and no surface is mapped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "services/inspection/deviation_service.h"
#include "storage/blobs.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/call.h"
#include "tests/support/fake_deviations.h"
#include "tests/support/listed_results.h"
#include "tests/support/must.h"
#include "tests/support/sample_results.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::inspection {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class DeviationHandlersTest : public ::testing::Test {
 protected:
  using Row = storage::DeviationMapRow;
  using Stub = v1::DeviationService::Stub;

  // Out at one area.
  static Row Sample() {
    Row row = testing::SampleDeviation();
    row.blade_serial = "sn1";
    row.part_id = "p1";
    row.registration_id = std::string(testing::kRegistration).substr(14);
    row.scan_ids = {"s0", "s1"};
    row.verdict = row.profiles.front().verdict = "NOT_CONFORM";
    row.profiles.front().area_count = 1;
    row.profiles.front().areas = {{true, 1, 1, *row.profiles.front().lowest, {}, {}}};
    return row;
  }
  // As if the request had been answered with it; gives its name.
  std::string Put(Row row = Sample(), const v1::MapDeviationRequest& request = {}) {
    row.deviation_id = storage::NewUuid();
    testing::Must(
        store_->Record(runtime::RecordedRequestOf("inspection.MapDeviation", request, ""), row, {}, {}).status());
    return "deviations/" + row.deviation_id;
  }
  static v1::MapDeviationRequest Request(const std::string& request_id = "") {
    v1::MapDeviationRequest request;
    request.set_registration(testing::kRegistration);
    request.set_request_id(request_id);
    return request;
  }
  absl::StatusOr<v1::DeviationMap> Map(const v1::MapDeviationRequest& request) {
    return testing::Call(*stub_, &Stub::MapDeviation, request);
  }
  absl::StatusOr<v1::DeviationMap> Get(const std::string& name) {
    v1::GetDeviationMapRequest request;
    request.set_name(name);
    return testing::Call(*stub_, &Stub::GetDeviationMap, request);
  }
  absl::StatusOr<v1::ListDeviationMapsResponse> List(const v1::ListDeviationMapsRequest& request) {
    return testing::Call(*stub_, &Stub::ListDeviationMaps, request);
  }
  testing::Streamed<v1::DeviationPatches> Patches(const std::string& name) {
    v1::DownloadDeviationPatchesRequest request;
    request.set_name(name);
    return testing::CallStream(*stub_, &Stub::DownloadDeviationPatches, request);
  }
  testing::Streamed<v1::DeviationCloudBlock> Cloud(const std::string& name) {
    v1::DownloadDeviationCloudRequest request;
    request.set_name(name);
    return testing::CallStream(*stub_, &Stub::DownloadDeviationCloud, request);
  }
  // Of every handler that is given a name.
  std::vector<absl::Status> StatusesOf(const std::string& name) {
    v1::ReplayDeviationMapRequest replay;
    replay.set_name(name);
    return {Get(name).status(), Patches(name).status, Cloud(name).status,
            testing::Call(*stub_, &Stub::ReplayDeviationMap, replay).status()};
  }

  testing::StandIns plant_;
  std::shared_ptr<testing::FakeDeviations> store_ = std::make_shared<testing::FakeDeviations>();
  DeviationService service_{
      store_,
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {}};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::DeviationService::NewStub(server_.Connect());
};

TEST_F(DeviationHandlersTest, AMapIsReadByItsName) {
  Put();
  const std::string name = Put();
  const auto map = Get(name);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->name(), name);
  EXPECT_EQ(map->blade(), "blades/sn1");
  EXPECT_EQ(map->registration(), testing::kRegistration);
  EXPECT_THAT(map->scans(), ElementsAre("scans/s0", "scans/s1"));
  EXPECT_EQ(map->record_sequence(), 2);
  EXPECT_EQ(map->verdict(), v1::VERDICT_NOT_CONFORM);
  ASSERT_THAT(map->profiles(), SizeIs(1));
  EXPECT_EQ(map->profiles(0).tolerance().characteristic(), "17");
  EXPECT_THAT(map->profiles(0).areas(), SizeIs(1));
  ASSERT_THAT(map->budget(), SizeIs(1));
  EXPECT_EQ(map->budget(0).source(), "points");
}

TEST_F(DeviationHandlersTest, ListsByPagesNewestFirstAndByWhatIsAskedFor) {
  Row other = Sample();
  other.blade_serial = "sn2";
  other.verdict = "CONFORM";
  const std::vector<std::string> names = {Put(), Put(other), Put(), Put(), Put()};
  testing::ExpectPagesNewestFirst<v1::ListDeviationMapsRequest>(
      names, [this](const auto& request) { return List(request); }, [](const auto& page) { return page.deviations(); });
  v1::ListDeviationMapsRequest request;
  request.set_verdict(v1::VERDICT_CONFORM);
  EXPECT_THAT(testing::ListedNames(List(request)->deviations()), ElementsAre(names[1]));
  request.clear_verdict();
  request.set_blade("blades/sn2");
  EXPECT_THAT(testing::ListedNames(List(request)->deviations()), ElementsAre(names[1]));
  request.set_part("parts/another");
  EXPECT_THAT(List(request)->deviations(), IsEmpty());
}

TEST_F(DeviationHandlersTest, AListLeavesTheAreasOutUnlessTheWholeIsAskedFor) {
  const std::string name = Put();
  v1::ListDeviationMapsRequest request;
  const auto basic = List(request);
  ASSERT_TRUE(basic.ok()) << basic.status();
  ASSERT_THAT(basic->deviations(), SizeIs(1));
  EXPECT_THAT(basic->deviations(0).profiles(0).areas(), IsEmpty());
  EXPECT_EQ(basic->deviations(0).profiles(0).area_count(), 1);
  request.set_view(list::v1::VIEW_FULL);
  const auto full = List(request);
  ASSERT_TRUE(full.ok()) << full.status();
  EXPECT_EQ(full->deviations(0).DebugString(), Get(name)->DebugString());
}

TEST_F(DeviationHandlersTest, AListRefusesEachFieldByItsName) {
  testing::ExpectListRefusals<v1::ListDeviationMapsRequest>([this](const auto& request) { return List(request); });
  v1::ListDeviationMapsRequest request;
  request.set_verdict(static_cast<v1::Verdict>(99));
  EXPECT_EQ(testing::RefusedField(List(request).status()), "verdict");
}

// Of messages of 10,000 at most: a map may have a hundred times as many.
TEST_F(DeviationHandlersTest, PatchesAreStreamedInTheirOrder) {
  constexpr int kCount = 10'001;
  Row row = Sample();
  row.patches = {};
  for (int i = 0; i < kCount; ++i) {
    for (const int axis : {0, 1, 2}) {
      row.patches.centres_in_part_mm.push_back(i + 0.25 * axis);
      row.patches.normals_in_part.push_back(axis == 2 ? 1 : 0);
    }
    row.patches.areas_mm2.push_back(1);
    row.patches.point_counts.push_back(i % 3);
    row.patches.means_um.push_back(i % 3 == 0 ? NAN : i);
    row.patches.expanded_uncertainties_um.push_back(i % 3 == 0 ? NAN : 0.5);
  }
  const auto streamed = Patches(Put(row));
  ASSERT_TRUE(streamed.status.ok()) << streamed.status;
  ASSERT_THAT(streamed.messages, SizeIs(2));
  EXPECT_EQ(streamed.messages[0].areas_mm2_size(), 10'000);
  v1::DeviationPatches all = streamed.messages[0];
  all.MergeFrom(streamed.messages[1]);
  ASSERT_EQ(all.areas_mm2_size(), kCount);
  ASSERT_EQ(all.centres_in_part_mm_size(), 3 * kCount);
  ASSERT_EQ(all.normals_in_part_size(), 3 * kCount);
  for (int i = 0; i < kCount; ++i) {
    ASSERT_EQ(all.centres_in_part_mm(3 * i + 1), i + 0.25) << i;
    ASSERT_EQ(all.point_counts(i), i % 3) << i;
    ASSERT_EQ(std::isnan(all.means_um(i)), i % 3 == 0) << i;
    ASSERT_EQ(std::isnan(all.expanded_uncertainties_um(i)), i % 3 == 0) << i;
    if (i % 3 == 0) continue;
    ASSERT_EQ(all.means_um(i), i);
  }
}

TEST_F(DeviationHandlersTest, ACloudIsStreamedBlockByBlockWithTheScanThatEachIsOf) {
  Row row = Sample();
  row.cloud_bytes = {"of the second scan", "of the first"};
  row.cloud = {{1, 20, 0, 0, storage::Sha256Hex(row.cloud_bytes[0])},
               {0, 10, 0, 0, storage::Sha256Hex(row.cloud_bytes[1])}};
  const auto streamed = Cloud(Put(row));
  ASSERT_TRUE(streamed.status.ok()) << streamed.status;
  ASSERT_THAT(streamed.messages, SizeIs(2));
  EXPECT_EQ(streamed.messages[0].scan(), "scans/s1");
  EXPECT_EQ(streamed.messages[0].point_count(), 20);
  EXPECT_EQ(streamed.messages[0].draco(), "of the second scan");
  EXPECT_EQ(streamed.messages[1].scan(), "scans/s0");
  EXPECT_EQ(streamed.messages[1].draco(), "of the first");
  const auto none = Cloud(Put());
  EXPECT_TRUE(none.status.ok()) << none.status;
  EXPECT_THAT(none.messages, IsEmpty());
}

TEST_F(DeviationHandlersTest, WhatIsNotRecordedIsNotFoundAndOtherNamesAreRefused) {
  Put();
  const std::string name = std::string("deviations/") + kSomeUuid;
  for (const absl::Status& status : StatusesOf(name)) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
    EXPECT_EQ(runtime::ReasonOf(status), "DEVIATION_MAP_NOT_FOUND");
    EXPECT_EQ(runtime::MetadataOf(status)["resource"], name);
  }
  for (const absl::Status& status : StatusesOf(std::string("inspections/") + kSomeUuid))
    EXPECT_EQ(testing::RefusedField(status), "name");
}

TEST_F(DeviationHandlersTest, SaysWhatTheStoreSays) {
  const std::string name = Put();
  store_->Fail(absl::ResourceExhaustedError("database: full"));
  std::vector<absl::Status> statuses = StatusesOf(name);
  statuses.push_back(List({}).status());
  statuses.push_back(Map(Request()).status());
  for (const absl::Status& status : statuses) {
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("database: full"));
  }
}

// A row of a newer release, after a step back to this one.
TEST_F(DeviationHandlersTest, AWordThatThisReleaseDoesNotKnowIsDataLoss) {
  Row row = Sample();
  row.profiles.front().zone = "ORIENTATION";
  const std::string name = Put(row);
  EXPECT_EQ(Get(name).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(List({}).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(DeviationHandlersTest, ARetryGetsWhatTheFirstCallRecordedWithoutAnyWork) {
  const std::string name = Put(Sample(), Request(kSomeUuid));
  plant_.registration.registration.set_name("registrations/gone");  // work would fail
  const auto again = Map(Request(kSomeUuid));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->DebugString(), Get(name)->DebugString());
  EXPECT_THAT(store_->rows(), SizeIs(1));
  v1::MapDeviationRequest other = Request(kSomeUuid);
  other.set_patch_mm(3);
  EXPECT_EQ(Map(other).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(Map(Request()).status().code(), absl::StatusCode::kNotFound) << "nothing is kept without an id";
}

TEST_F(DeviationHandlersTest, NothingIsRecordedOfWhatIsRefused) {
  v1::MapDeviationRequest request = Request();
  request.set_registration("scans/s0");
  EXPECT_EQ(testing::RefusedField(Map(request).status()), "registration");
  request = Request();
  request.set_patch_mm(0.05);
  EXPECT_EQ(testing::RefusedField(Map(request).status()), "patch_mm");
  plant_.registration.registration.mutable_evidence()->set_outcome(registration::v1::OUTCOME_NOT_CONVERGED);
  EXPECT_EQ(runtime::ReasonOf(Map(Request()).status()), "REGISTRATION_NOT_CONVERGED");
  EXPECT_THAT(plant_.ingest.downloads(), IsEmpty());
  EXPECT_THAT(store_->rows(), IsEmpty());
  EXPECT_THAT(store_->entries(), IsEmpty());
}

}  // namespace
}  // namespace sixpoint::inspection
