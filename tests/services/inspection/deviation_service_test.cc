// The deviation map of the pinned block, whose top was scanned 5 um too high: kept, and read back, patch by patch and point by point.
#include "services/inspection/deviation_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "metrology/cloud/deviation_cloud.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/blobs.h"
#include "storage/record.h"
#include "tests/services/correction/judged_plant.h"
#include "tests/support/sanitizer.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::inspection {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class DeviationServiceTest : public ::testing::Test {
 protected:
  DeviationServiceTest() {
    for (const std::string& scan : plant_.scans) plant_.registration.registration.add_scans(scan);
  }
  absl::StatusOr<v1::DeviationMap> Map(const v1::MapDeviationRequest& request) {
    v1::DeviationMap map;
    const grpc::Status status =
        stub_->MapDeviation(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &map);
    if (!status.ok()) return runtime::FromGrpc(status);
    return map;
  }
  // Patches of 2 mm, the top and its lower half as regions, each with its tolerance.
  static v1::MapDeviationRequest Request() {
    v1::MapDeviationRequest request;
    request.set_registration(testing::kRegistration);
    request.set_patch_mm(2);
    v1::SurfaceRegion& top = *request.add_regions();
    top.set_region("top");
    top.mutable_facing_in_part()->set_z(1);
    v1::SurfaceRegion& bottom = *request.add_regions();
    bottom.set_region("bottom");
    bottom.mutable_facing_in_part()->set_z(-1);
    AddProfile("17", "top", v1::PROFILE_ZONE_FORM_AND_LOCATION, -0.02, 0.02, &request);
    AddProfile("18", "top", v1::PROFILE_ZONE_FORM_AND_LOCATION, -0.02, 0.001, &request);
    AddProfile("19", "top", v1::PROFILE_ZONE_FORM, -0.02, 0.02, &request);
    AddProfile("20", "bottom", v1::PROFILE_ZONE_FORM_AND_LOCATION, -1, 1, &request);
    return request;
  }
  static void AddProfile(const std::string& characteristic, const std::string& region, v1::ProfileZone zone,
                         double lower_mm, double upper_mm, v1::MapDeviationRequest* request) {
    v1::ProfileTolerance& profile = *request->add_profiles();
    profile.set_characteristic(characteristic);
    profile.set_region(region);
    profile.set_zone(zone);
    profile.set_lower_mm(lower_mm);
    profile.set_upper_mm(upper_mm);
    profile.set_least_coverage(0.5);
  }
  v1::DeviationPatches PatchesOf(const std::string& name) {
    v1::DownloadDeviationPatchesRequest request;
    request.set_name(name);
    const auto context = runtime::ContextFor(10);
    const auto reader = stub_->DownloadDeviationPatches(context.get(), request);
    v1::DeviationPatches all;
    for (v1::DeviationPatches some; reader->Read(&some);) all.MergeFrom(some);
    EXPECT_TRUE(reader->Finish().ok());
    return all;
  }
  std::int64_t Count(const std::string& table) {
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    return transaction->Execute("SELECT count(*) FROM " + table)->Int(0, 0);
  }

  testing::JudgedPlant plant_;
  DeviationService service_{
      storage::DeviationsIn(plant_.database.database()),
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {}};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::DeviationService::Stub> stub_ = v1::DeviationService::NewStub(server_.Connect());
};

TEST_F(DeviationServiceTest, MapsTheSurfaceAndReadsBackTheSame) {
  const auto map = Map(Request());
  ASSERT_TRUE(map.ok()) << map.status();
  ASSERT_EQ(map->statistics_size(), 3);
  const v1::DeviationStatistics &whole = map->statistics(0), &top = map->statistics(1), &bottom = map->statistics(2);
  // 30 x 30 x 10 mm, a thousand points of each pin.
  EXPECT_NEAR(whole.area_mm2(), 2 * 900 + 4 * 300, 1e-6);
  EXPECT_NEAR(top.area_mm2(), 900, 1e-6);
  EXPECT_EQ(top.region(), "top");
  EXPECT_NEAR(top.mean_um(), 5, 0.3);
  EXPECT_NEAR(top.p50_um(), 5, 0.3);
  EXPECT_GT(top.seen_area_mm2(), 700);
  EXPECT_LT(std::abs(top.lowest().mean_um() - 5), 4);
  EXPECT_GT(top.lowest().expanded_uncertainty_um(), 0.1);
  EXPECT_FALSE(bottom.has_mean_um());
  EXPECT_EQ(bottom.seen_area_mm2(), 0);
  EXPECT_FALSE(bottom.has_lowest());
  EXPECT_GT(map->points().set_aside(), 1900);  // pins
  EXPECT_FALSE(map->budget().empty());

  v1::GetDeviationMapRequest get;
  get.set_name(map->name());
  v1::DeviationMap back;
  ASSERT_TRUE(stub_->GetDeviationMap(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.DebugString(), map->DebugString());

  v1::ListDeviationMapsRequest list;
  list.set_blade("blades/sn1");
  list.set_verdict(v1::VERDICT_NOT_CONFORM);
  v1::ListDeviationMapsResponse listed;
  ASSERT_TRUE(stub_->ListDeviationMaps(runtime::ContextFor(10).get(), list, &listed).ok());
  ASSERT_EQ(listed.deviations_size(), 1);
  EXPECT_THAT(listed.deviations(0).profiles(1).areas(), IsEmpty());  // the basic view
  list.set_verdict(v1::VERDICT_CONFORM);
  ASSERT_TRUE(stub_->ListDeviationMaps(runtime::ContextFor(10).get(), list, &listed).ok());
  EXPECT_THAT(listed.deviations(), IsEmpty());

  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, plant_.scans[2]);
  ASSERT_TRUE(derived.ok());
  std::vector<std::string> names;
  for (const storage::JournalEntry& journal : *derived) names.push_back(journal.entry.name);
  EXPECT_THAT(names, Contains(map->name()));
}

TEST_F(DeviationServiceTest, JudgesProfilesAndNeverPassesWhatWasNotSeen) {
  const auto map = Map(Request());
  ASSERT_TRUE(map.ok()) << map.status();
  ASSERT_EQ(map->profiles_size(), 4);
  EXPECT_EQ(map->profiles(0).verdict(), v1::VERDICT_CONFORM) << map->profiles(0).reason();
  const v1::ProfileFinding& out = map->profiles(1);
  EXPECT_EQ(out.verdict(), v1::VERDICT_NOT_CONFORM);
  ASSERT_EQ(out.areas_size(), out.area_count());
  ASSERT_GT(out.areas_size(), 0);
  EXPECT_TRUE(out.areas(0).above());
  EXPECT_NEAR(out.areas(0).worst().mean_um(), 5, 4);
  EXPECT_LE(out.out_mm2(), map->statistics(1).seen_area_mm2() + 1e-9);
  EXPECT_EQ(map->profiles(2).verdict(), v1::VERDICT_CONFORM);
  // As the datums put it the zone sees the surface 5 um up; of form it lies about the surface.
  EXPECT_EQ(map->profiles(0).highest().mean_um(), map->statistics(1).highest().mean_um());
  EXPECT_LT(map->profiles(2).lowest().mean_um(), 0);
  EXPECT_GT(map->profiles(2).highest().mean_um(), 0);
  EXPECT_FALSE(map->profiles(3).has_lowest());
  ASSERT_EQ(map->profiles(2).motion_size(), 6);
  EXPECT_THAT(map->profiles(0).motion(), IsEmpty());
  EXPECT_EQ(map->profiles(3).verdict(), v1::VERDICT_NOT_MEASURED);
  EXPECT_THAT(map->profiles(3).reason(), HasSubstr("0 % were seen, want 50 %"));
  EXPECT_EQ(map->verdict(), v1::VERDICT_NOT_CONFORM);
  EXPECT_THAT(map->decision_rule(), HasSubstr("ISO 14253-1"));

  // However little is wanted: of nothing there is no verdict.
  v1::MapDeviationRequest least = Request();
  least.mutable_profiles(3)->set_least_coverage(0);
  EXPECT_EQ(Map(least)->profiles(3).verdict(), v1::VERDICT_NOT_MEASURED);
  least.mutable_regions(1)->mutable_minimum_in_part_mm()->set_x_mm(-1e9);
  EXPECT_THAT(std::string(Map(least).status().message()), HasSubstr("coordinates within 1000000 mm"));

  v1::MapDeviationRequest without = Request();
  without.clear_profiles();
  const auto unjudged = Map(without);
  ASSERT_TRUE(unjudged.ok()) << unjudged.status();
  EXPECT_EQ(unjudged->verdict(), v1::VERDICT_UNSPECIFIED);
  EXPECT_EQ(unjudged->decision_rule(), "");
}

TEST_F(DeviationServiceTest, PatchesAreThoseOfTheStatistics) {
  const auto map = Map(Request());
  ASSERT_TRUE(map.ok()) << map.status();
  const v1::DeviationPatches patches = PatchesOf(map->name());
  ASSERT_EQ(patches.areas_mm2_size(), map->patch_count());
  ASSERT_EQ(patches.centres_in_part_mm_size(), 3 * map->patch_count());
  double area_mm2 = 0, seen_mm2 = 0, lowest_um = std::numeric_limits<double>::infinity();
  for (int i = 0; i < map->patch_count(); ++i) {
    area_mm2 += patches.areas_mm2(i);
    EXPECT_EQ(std::isnan(patches.means_um(i)), std::isnan(patches.expanded_uncertainties_um(i)));
    if (std::isnan(patches.means_um(i))) continue;
    EXPECT_GE(patches.point_counts(i), 10);
    EXPECT_GT(patches.normals_in_part(3 * i + 2), 0.9);  // the top alone was scanned
    seen_mm2 += patches.areas_mm2(i);
    lowest_um = std::min<double>(lowest_um, patches.means_um(i));
  }
  EXPECT_NEAR(area_mm2, map->statistics(0).area_mm2(), 1e-3);
  EXPECT_NEAR(seen_mm2, map->statistics(0).seen_area_mm2(), 1e-3);
  EXPECT_NEAR(lowest_um, map->statistics(0).lowest().mean_um(), 1e-5);
  const int lowest = map->statistics(0).lowest().patch();
  EXPECT_EQ(patches.centres_in_part_mm(3 * lowest), map->statistics(0).lowest().centre_in_part_mm().x_mm());
}

TEST_F(DeviationServiceTest, KeepsThePointsAsACloudUnlessToldOtherwise) {
  const auto map = Map(Request());
  ASSERT_TRUE(map.ok()) << map.status();
  v1::DownloadDeviationCloudRequest request;
  request.set_name(map->name());
  const auto context = runtime::ContextFor(10);
  const auto reader = stub_->DownloadDeviationCloud(context.get(), request);
  std::vector<std::string> scans, digests;
  std::int64_t count = 0;
  double sum_um = 0;
  for (v1::DeviationCloudBlock block; reader->Read(&block);) {
    scans.push_back(block.scan());
    digests.push_back(storage::Sha256Hex(block.draco()));
    const auto points = metrology::DecodeDeviations(block.draco(), block.point_count());
    ASSERT_TRUE(points.ok()) << points.status();
    count += block.point_count();
    for (std::size_t i = 0; i < points->in_part_mm.size(); ++i) {
      sum_um += 1e3 * points->deviations_mm[i];
      EXPECT_NEAR(points->in_part_mm[i].z(), points->deviations_mm[i], 5.1e-3);  // the top is z = 0
    }
  }
  ASSERT_TRUE(reader->Finish().ok());
  EXPECT_EQ(scans, plant_.scans);
  EXPECT_EQ(count, map->points().compared());
  EXPECT_NEAR(sum_um / static_cast<double>(count), 5, 0.1);
  EXPECT_EQ(map->cloud_sha256(), storage::Sha256OfDigests(digests));

  v1::MapDeviationRequest without = Request();
  without.set_without_cloud(true);
  const auto slim = Map(without);
  ASSERT_TRUE(slim.ok()) << slim.status();
  EXPECT_EQ(slim->cloud_sha256(), "");
  EXPECT_EQ(slim->patches_sha256(), map->patches_sha256());
  EXPECT_EQ(Count("deviation_cloud_blocks"), 4);
}

TEST_F(DeviationServiceTest, ARetryComputesNothingAnew) {
  v1::MapDeviationRequest request = Request();
  request.set_request_id(kSomeUuid);
  const auto first = Map(request);
  ASSERT_TRUE(first.ok()) << first.status();
  const auto downloads = plant_.ingest.downloads();
  const auto again = Map(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->SerializeAsString(), first->SerializeAsString());
  EXPECT_EQ(plant_.ingest.downloads(), downloads);
  EXPECT_EQ(Count("deviation_maps"), 1);
}

TEST_F(DeviationServiceTest, RefusesWhatCannotBeMeantAndKeepsNothing) {
  const auto refusal = [this](const std::function<void(v1::MapDeviationRequest*)>& change) {
    v1::MapDeviationRequest request = Request();
    change(&request);
    const auto map = Map(request);
    return map.ok() ? std::string("no refusal") : std::string(map.status().message());
  };
  using R = v1::MapDeviationRequest;
  EXPECT_THAT(refusal([](R* r) { r->set_registration("scans/s1"); }), HasSubstr("registration: scans/s1"));
  EXPECT_THAT(refusal([](R* r) { r->set_patch_mm(0.05); }), HasSubstr("patch_mm: 0.05, want 0.1 to 20"));
  EXPECT_THAT(refusal([](R* r) { r->set_patch_mm(std::nan("")); }), HasSubstr("patch_mm: NaN, want 0.1 to 20"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_regions(1)->set_region("top"); }),
              HasSubstr("regions[1].region: top, want another one: it is used before"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_profiles(1)->set_characteristic("18 "); }),
              HasSubstr("profiles[1].characteristic: 18 , want a name without blanks"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_regions(1)->clear_facing_in_part(); }),
              HasSubstr("regions[1]: not bounded, want a corner of its box or facing_in_part"));
  EXPECT_THAT(refusal([](R* r) {
                r->mutable_regions(1)->mutable_minimum_in_part_mm()->set_x_mm(5);
                r->mutable_regions(1)->mutable_maximum_in_part_mm()->set_x_mm(5);
              }),
              HasSubstr("regions[1].maximum_in_part_mm: not above minimum_in_part_mm"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_regions(1)->mutable_minimum_in_part_mm()->set_z_mm(50); }),
              HasSubstr("regions[1]: bottom, want a region with a patch of the part's surface"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_profiles(2)->set_region("edge"); }),
              HasSubstr("profiles[2].region: edge, want one of `regions`, or none"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_profiles(2)->clear_upper_mm(); }),
              HasSubstr("profiles[2].upper_mm: not stated, want mm of the deviation"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_profiles(2)->set_lower_mm(0.03); }),
              HasSubstr("profiles[2].lower_mm: 0.03, want below upper_mm"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_profiles(2)->set_lower_mm(std::nan("")); }),
              HasSubstr("profiles[2].lower_mm: NaN, want -100 to 100 mm"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_profiles(2)->clear_zone(); }), HasSubstr("profiles[2].zone"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_profiles(2)->set_least_coverage(1.5); }),
              HasSubstr("profiles[2].least_coverage: 1.5, want 0 to 1"));
  plant_.registration.registration.mutable_evidence()->set_outcome(registration::v1::OUTCOME_NOT_CONVERGED);
  const absl::Status no_pose = Map(Request()).status();
  EXPECT_EQ(runtime::ReasonOf(no_pose), "REGISTRATION_NOT_CONVERGED") << no_pose;
  EXPECT_EQ(Count("deviation_maps"), 0);
  EXPECT_EQ(Count("record_entries WHERE kind = 'deviation'"), 0);
}

TEST_F(DeviationServiceTest, WhatIsNotRecordedIsNotFound) {
  const std::string name = std::string("deviations/") + kSomeUuid;
  v1::GetDeviationMapRequest get;
  get.set_name(name);
  v1::DeviationMap map;
  const absl::Status missing = runtime::FromGrpc(stub_->GetDeviationMap(runtime::ContextFor(10).get(), get, &map));
  EXPECT_EQ(runtime::ReasonOf(missing), "DEVIATION_MAP_NOT_FOUND") << missing;
  v1::DownloadDeviationPatchesRequest patches;
  patches.set_name(name);
  const auto context = runtime::ContextFor(10);
  const auto reader = stub_->DownloadDeviationPatches(context.get(), patches);
  v1::DeviationPatches some;
  EXPECT_FALSE(reader->Read(&some));
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(reader->Finish())), "DEVIATION_MAP_NOT_FOUND");
}

}  // namespace
}  // namespace sixpoint::inspection
