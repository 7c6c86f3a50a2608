// What every ScanStore with its RetentionStore does, PostgreSQL's and the fake that handlers are tested on.
#include "storage/scan_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>

#include "storage/blobs.h"
#include "storage/retention_store.h"
#include "tests/support/fake_scans.h"
#include "tests/support/stored_scan.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::FakeScans;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const auto kGoesOn = [](const ScanUploadRow&) -> absl::StatusOr<bool> { return true; };

ScanUploadRow NewUpload(const std::string& scan_id, const std::string& header = "header") {
  ScanUploadRow upload;
  upload.scan_id = scan_id;
  upload.header = header;
  upload.machine_revision = 3;
  upload.artefact_revision = 2;
  return upload;
}

// One point more.
absl::StatusOr<bool> Add(ScanStore& scans, ScanUploadRow* upload, const std::string& payload) {
  ScanUploadRow after = *upload;
  ++after.next_block;
  ++after.point_count;
  ++after.profile_count;
  after.stored_bytes += static_cast<std::int64_t>(payload.size());
  after.open_profile_points = 1;
  ScanBlockRow block;
  block.point_count = 1;
  block.first_profile = after.profile_count - 1;
  block.profile_count = 1;
  block.sent_sha256 = Sha256Hex(payload);
  const absl::StatusOr<bool> added = scans.AddBlock(after, block, payload, "", Soon());
  if (added.ok() && *added) *upload = after;
  return added;
}

absl::StatusOr<MadeScan> Made(const ScanUploadRow& upload, const std::vector<ScanBlockRow>& blocks) {
  MadeScan made;
  made.row.scan_id = upload.scan_id;
  made.row.machine_id = "m1";
  made.row.machine_revision = upload.machine_revision;
  made.row.artefact_id = "p1";
  made.row.artefact_revision = *upload.artefact_revision;
  made.row.kind = "artefact";
  made.row.profile_pitch_mm = 0.05;
  made.row.columns_per_profile = 100;
  made.row.encoding = made.row.stored_encoding = "draco";
  made.row.point_count = upload.point_count;
  made.row.profile_count = upload.profile_count;
  made.row.block_count = static_cast<int>(blocks.size());
  made.row.stored_bytes = upload.stored_bytes;
  made.row.stored_sha256 = made.row.sent_sha256 = blocks.empty() ? std::string(64, '0') : blocks.front().sent_sha256;
  made.entry.kind = "scan";
  made.entry.name = "scans/" + upload.scan_id;
  made.entry.machine = "m1";
  made.entry.software_version = "test";
  return made;
}

void Store(ScanStore& scans, const std::string& scan_id, const std::vector<std::string>& payloads) {
  const auto known = scans.Join(NewUpload(scan_id), kGoesOn, Soon());
  ASSERT_TRUE(known.ok()) << known.status();
  ScanUploadRow upload = known->upload;
  for (const std::string& payload : payloads) {
    const auto added = Add(scans, &upload, payload);
    ASSERT_TRUE(added.ok() && *added) << added.status();
  }
  const auto completed = scans.Complete(scan_id, Made, Soon());
  ASSERT_TRUE(completed.ok() && completed->has_value()) << completed.status();
}

std::vector<std::string> ScanIds(const absl::StatusOr<std::vector<ScanRow>>& rows) {
  EXPECT_TRUE(rows.ok()) << rows.status();
  std::vector<std::string> ids;
  for (const ScanRow& row : *rows) ids.push_back(row.scan_id);
  return ids;
}

DeletionOrder OrderOf(const std::string& scan_id) { return {scan_id, "not needed", "a person", "test", std::nullopt}; }

// Each test runs on both.
void OnBothScanStores(const std::function<void(ScanStore& scans, RetentionStore& retention)>& test) {
  {
    SCOPED_TRACE("the fake");
    FakeScans fake;
    test(fake, fake);
  }
  SCOPED_TRACE("PostgreSQL");
  sixpoint::testing::ThrowawayDatabase database;
  sixpoint::testing::PutScanSubjects(database.database());
  const std::shared_ptr<BlobStore> blobs = MakePostgresqlBlobStore();
  test(*ScansIn(database.database(), blobs.get()), *RetentionIn(database.database(), blobs));
}

TEST(ScanStore, AnUploadIsGoneOnWithWhereItWas) {
  OnBothScanStores([](ScanStore& scans, RetentionStore&) {
    ScanUploadRow upload = scans.Join(NewUpload("s1"), kGoesOn, Soon())->upload;
    EXPECT_EQ(upload.next_block, 0);
    ASSERT_TRUE(*Add(scans, &upload, "first"));
    const auto again = scans.Join(NewUpload("s1", "another"), kGoesOn, Soon());
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_FALSE(again->complete);
    EXPECT_EQ(again->upload.header, "header");
    EXPECT_EQ(again->upload.next_block, 1);
    EXPECT_EQ(again->upload.stored_bytes, 5);
    EXPECT_EQ(scans.UploadedBlocks("s1", Soon())->front().sent_sha256, Sha256Hex("first"));
    EXPECT_FALSE(scans.Find("s1", Soon())->has_value());
  });
}

TEST(ScanStore, AnUploadBeginsAnewOrIsRefusedAsItsCallerSays) {
  OnBothScanStores([](ScanStore& scans, RetentionStore&) {
    ASSERT_TRUE(scans.Join(NewUpload("s1"), kGoesOn, Soon()).ok());
    const auto refuse = [](const ScanUploadRow&) -> absl::StatusOr<bool> { return absl::AbortedError("differs"); };
    EXPECT_EQ(scans.Join(NewUpload("s1"), refuse, Soon()).status().code(), absl::StatusCode::kAborted);
    const auto anew = [](const ScanUploadRow& known) -> absl::StatusOr<bool> { return known.header == "mended"; };
    EXPECT_EQ(scans.Join(NewUpload("s1", "mended"), anew, Soon())->upload.header, "mended");
    EXPECT_EQ(scans.Join(NewUpload("s1", "third"), kGoesOn, Soon())->upload.header, "mended");
  });
}

TEST(ScanStore, OfTwoStreamsOneIsQuicker) {
  OnBothScanStores([](ScanStore& scans, RetentionStore&) {
    ScanUploadRow upload = scans.Join(NewUpload("s1"), kGoesOn, Soon())->upload, slower = upload;
    ASSERT_TRUE(*Add(scans, &upload, "first"));
    EXPECT_FALSE(*Add(scans, &slower, "also first"));
    EXPECT_EQ(scans.UploadedBlocks("s1", Soon())->size(), 1u);
    ScanUploadRow unknown = NewUpload("s9");
    EXPECT_FALSE(*Add(scans, &unknown, "of nothing"));
  });
}

TEST(ScanStore, ACompleteScanHasItsBlocksAndItsUploadIsGone) {
  OnBothScanStores([](ScanStore& scans, RetentionStore&) {
    Store(scans, "s1", {"first", "second"});
    const auto found = scans.Find("s1", Soon());
    ASSERT_TRUE(found.ok() && found->has_value()) << found.status();
    EXPECT_EQ((**found).machine_revision, 3);
    EXPECT_EQ((**found).point_count, 2);
    EXPECT_GT((**found).recorded.sequence, 0);
    const auto blocks = scans.Blocks("s1", Soon());
    ASSERT_EQ(blocks->size(), 2u);
    EXPECT_EQ((*blocks)[1].first_profile, 1);
    EXPECT_EQ(*scans.Payload((*blocks)[1].blob_sha256, Soon()), "second");
    EXPECT_EQ(scans.Payload(Sha256Hex("never"), Soon()).status().code(), absl::StatusCode::kNotFound);
    EXPECT_THAT(*scans.UploadedBlocks("s1", Soon()), IsEmpty());
    EXPECT_EQ(scans.Join(NewUpload("s1"), kGoesOn, Soon())->complete->scan_id, "s1");
    EXPECT_TRUE((**scans.Complete("s1", Made, Soon())).was_complete);
    EXPECT_FALSE(scans.Complete("s9", Made, Soon())->has_value());
  });
}

TEST(ScanStore, AScanThatCannotBeMadeLeavesItsUpload) {
  OnBothScanStores([](ScanStore& scans, RetentionStore&) {
    ScanUploadRow upload = scans.Join(NewUpload("s1"), kGoesOn, Soon())->upload;
    ASSERT_TRUE(*Add(scans, &upload, "first"));
    const auto refuse = [](const ScanUploadRow&, const std::vector<ScanBlockRow>&) -> absl::StatusOr<MadeScan> {
      return absl::InvalidArgumentError("end");
    };
    EXPECT_EQ(scans.Complete("s1", refuse, Soon()).status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(scans.UploadedBlocks("s1", Soon())->size(), 1u);
    EXPECT_FALSE(scans.Find("s1", Soon())->has_value());
  });
}

TEST(ScanStore, ListsNewestFirstByFilters) {
  OnBothScanStores([](ScanStore& scans, RetentionStore&) {
    for (const char* id : {"s1", "s2", "s3"}) Store(scans, id, {id});
    EXPECT_THAT(ScanIds(scans.List({}, 0, 2, Soon())), ElementsAre("s3", "s2"));
    EXPECT_THAT(ScanIds(scans.List({}, (**scans.Find("s2", Soon())).recorded.sequence, 2, Soon())), ElementsAre("s1"));
    ScanFilter filter;
    filter.artefact_id = "p1";
    filter.kind = "artefact";
    filter.machine_id = "m1";
    EXPECT_EQ(ScanIds(scans.List(filter, 0, 10, Soon())).size(), 3u);
    filter.kind = "arm";
    EXPECT_THAT(ScanIds(scans.List(filter, 0, 10, Soon())), IsEmpty());
    filter = {};
    filter.recorded.until = std::chrono::system_clock::now() - std::chrono::hours(1);
    EXPECT_THAT(ScanIds(scans.List(filter, 0, 10, Soon())), IsEmpty());
  });
}

TEST(ScanStore, DeletedPointsGoWhereNoOtherScanNeedsThem) {
  OnBothScanStores([](ScanStore& scans, RetentionStore& retention) {
    Store(scans, "s1", {"own", "shared"});
    Store(scans, "s2", {"shared"});
    EXPECT_FALSE(retention.FindDeletion("s1", Soon())->has_value());
    EXPECT_EQ(retention.DeletePoints(OrderOf("s9"), Soon()).status().code(), absl::StatusCode::kNotFound);
    const auto deleted = retention.DeletePoints(OrderOf("s1"), Soon());
    ASSERT_TRUE(deleted.ok()) << deleted.status();
    EXPECT_FALSE(deleted->already_deleted);
    EXPECT_EQ(deleted->freed_bytes, 3);
    EXPECT_EQ(deleted->deletion.points_bytes, 9);
    EXPECT_TRUE(retention.DeletePoints(OrderOf("s1"), Soon())->already_deleted);
    EXPECT_EQ((**retention.FindDeletion("s1", Soon())).reason, "not needed");
    EXPECT_EQ(scans.RequirePoints("s1", Soon()).code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_TRUE(scans.RequirePoints("s2", Soon()).ok());
    EXPECT_EQ(scans.Payload(Sha256Hex("own"), Soon()).status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(*scans.Payload(Sha256Hex("shared"), Soon()), "shared");
    EXPECT_EQ(scans.Blocks("s1", Soon())->size(), 2u);
  });
}

// Its kind and revision.
absl::StatusOr<std::string> RecordPolicy(RetentionStore& retention, const RetentionPolicy& policy,
                                         const std::string& request_id = "") {
  RecordEntry entry;
  entry.software_version = "test";
  const auto set = retention.Record({"ingest.SetRetentionPolicy", request_id, "request"}, policy, entry, Soon());
  if (!set.ok()) return set.status();
  return set->scan_kind + "@" + std::to_string(set->revision);
}

TEST(ScanStore, APolicyIsSetOnceForEachRequest) {
  OnBothScanStores([](ScanStore&, RetentionStore& retention) {
    constexpr char kRequest[] = "5f0f3c9e-6a52-4d3a-9a63-2f1d1f6f0b11";
    RetentionPolicy policy;
    policy.scan_kind = "arm";
    policy.requested_by = "a person";
    EXPECT_EQ(*RecordPolicy(retention, policy, kRequest), "arm@1");
    EXPECT_EQ(*RecordPolicy(retention, policy, kRequest), "arm@1");
    EXPECT_EQ(*RecordPolicy(retention, policy), "arm@2");
  });
}

TEST(ScanStore, PoliciesHaveRevisionsAndTakeNothingThatIsYoung) {
  OnBothScanStores([](ScanStore& scans, RetentionStore& retention) {
    Store(scans, "s1", {"young"});
    RetentionPolicy policy;
    policy.scan_kind = "artefact";
    policy.requested_by = "a person";
    EXPECT_EQ(*RecordPolicy(retention, policy), "artefact@1");
    policy.keep_days = 30;
    EXPECT_EQ(*RecordPolicy(retention, policy), "artefact@2");
    policy.scan_kind = "arm";
    EXPECT_EQ(*RecordPolicy(retention, policy), "arm@1");
    PolicyPage page;
    page.limit = 10;
    const auto newest = retention.ListPolicies(page, Soon());
    ASSERT_EQ(newest->size(), 2u);
    EXPECT_EQ((*newest)[0].scan_kind, "arm");
    EXPECT_EQ((*newest)[1].revision, 2);
    EXPECT_GT((*newest)[1].recorded.sequence, 0);
    page.all_revisions = true;
    EXPECT_EQ(retention.ListPolicies(page, Soon())->size(), 3u);
    page.limit = 1;
    page.after_kind = "artefact";
    page.after_revision = 2;
    const auto last = retention.ListPolicies(page, Soon());
    ASSERT_EQ(last->size(), 1u);
    EXPECT_EQ(last->front().revision, 1);
    EXPECT_FALSE(last->front().keep_days.has_value());
    EXPECT_EQ(retention.Apply({}, Soon())->scan_count, 0);
    DeletionOrder order = OrderOf("s1");
    order.policy = policy;
    order.policy->scan_kind = "artefact";
    order.policy->revision = 1;  // no longer the newest
    EXPECT_EQ(retention.DeletePoints(order, Soon()).status().code(), absl::StatusCode::kAborted);
  });
}

}  // namespace
}  // namespace sixpoint::storage
