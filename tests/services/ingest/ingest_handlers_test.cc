// The handlers on a fake store: no PostgreSQL, no decode worker. What they do to bytes is tested in scan_service_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/ingest/scan_messages.h"
#include "services/ingest/scan_service.h"
#include "services/ingest/store_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "tests/services/ingest/conversation.h"
#include "tests/services/ingest/fake_plant.h"
#include "tests/services/ingest/sample_scans.h"
#include "tests/support/call.h"
#include "tests/support/fake_scans.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::ingest {
namespace {

using testing::Call;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Scans = v1::ScanService::Stub;
using Store = v1::CloudStoreService::Stub;

class IngestHandlersTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::Scan> Get(const std::string& name) {
    v1::GetScanRequest request;
    request.set_name(name);
    return Call(*scans_, &Scans::GetScan, request);
  }
  absl::StatusOr<v1::DeleteScanPointsResponse> Delete(const std::string& name, const std::string& reason) {
    v1::DeleteScanPointsRequest request;
    request.set_name(name);
    request.set_reason(reason);
    return Call(*store_, &Store::DeleteScanPoints, request);
  }
  // Of 400 points in four blocks, of which the first `block_count` are sent; with its end where that is all of them.
  absl::StatusOr<v1::StoredScan> Upload(const std::string& scan_id, std::size_t block_count = 4) {
    const v1::ScanHeader header = SampleHeader(scan_id, 400, v1::ENCODING_XYZ_F64);
    const auto blocks = SampleBlocks(SampleProfiles(4, 100), 100, v1::ENCODING_XYZ_F64);
    Conversation upload(scans_.get(), 10);
    v1::UploadScanResponse response = upload.Say(header);
    for (auto next = static_cast<std::size_t>(response.accepted().next_block()); next < block_count; ++next) {
      upload.Send(blocks[next]);
      upload.Hear(&response);
    }
    if (block_count == blocks.size()) {
      upload.Send(EndOf(blocks));
      while (upload.Hear(&response) && !response.has_stored()) {
      }
    }
    const absl::Status status = upload.Finish();
    if (!status.ok()) return status;
    return response.stored();
  }

  FakePlant plant_;
  testing::InProcessServer plant_server_{{&plant_}};
  std::shared_ptr<testing::FakeScans> kept_ = std::make_shared<testing::FakeScans>();
  std::shared_ptr<testing::FakeBlobKeeping> blobs_ = std::make_shared<testing::FakeBlobKeeping>();
  ScanService service_{{}, kept_, plant_server_.Connect()};
  CloudStoreService store_service_{kept_, blobs_};
  testing::InProcessServer server_{{&service_, &store_service_}};
  std::unique_ptr<Scans> scans_ = v1::ScanService::NewStub(server_.Connect());
  std::unique_ptr<Store> store_ = v1::CloudStoreService::NewStub(server_.Connect());
};

TEST_F(IngestHandlersTest, AScanComesInIsGotAndListed) {
  const auto stored = Upload("s1");
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_FALSE(stored->already_stored());
  EXPECT_EQ(Get("scans/s1")->SerializeAsString(), stored->scan().SerializeAsString());
  const storage::RecordEntry entry = kept_->entries().front().entry;
  EXPECT_EQ(entry.name, "scans/s1");
  EXPECT_EQ(entry.blade, "sn1");
  EXPECT_THAT(entry.inputs, ElementsAre("machines/m1@3", "blades/sn1"));
  ASSERT_TRUE(Upload("s2").ok());
  v1::ListScansRequest list;
  list.set_page_size(1);
  const auto page = Call(*scans_, &Scans::ListScans, list);
  ASSERT_EQ(page->scans_size(), 1);
  EXPECT_EQ(page->scans(0).name(), "scans/s2");
  list.set_page_token(page->next_page_token());
  EXPECT_EQ(Call(*scans_, &Scans::ListScans, list)->scans(0).name(), "scans/s1");
  list.set_subject("blades/sn2");
  EXPECT_EQ(Call(*scans_, &Scans::ListScans, list).status().code(), absl::StatusCode::kInvalidArgument);
  list.clear_page_token();
  EXPECT_EQ(Call(*scans_, &Scans::ListScans, list)->scans_size(), 0);
}

TEST_F(IngestHandlersTest, AHeaderIsHeldToTheContractsBounds) {
  v1::ScanHeader header = SampleHeader("s1", 400, v1::ENCODING_XYZ_F64);
  header.set_sensor_serial_number(std::string(65, 'x'));
  Conversation upload(scans_.get(), 10);
  EXPECT_FALSE(upload.Say(header).has_accepted());
  EXPECT_THAT(std::string(upload.Finish().message()),
              HasSubstr("header.sensor_serial_number: 65 bytes, want at most 64"));
}

TEST_F(IngestHandlersTest, AnUploadThatBrokeIsGoneOnWithAndASecondOneIsKnown) {
  EXPECT_FALSE(Upload("s1", 2).ok());
  EXPECT_EQ(runtime::ReasonOf(Get("scans/s1").status()), "SCAN_NOT_FOUND");
  EXPECT_EQ(kept_->UploadedBlocks("s1", {})->size(), 2u);
  const auto stored = Upload("s1");
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_TRUE(Upload("s1")->already_stored());
  EXPECT_EQ(kept_->entries().size(), 1u);
}

TEST_F(IngestHandlersTest, PointsComeBackAndAreGoneOnceDeleted) {
  ASSERT_TRUE(Upload("s1").ok());
  v1::PreviewScanRequest preview;
  preview.set_name("scans/s1");
  EXPECT_EQ(Call(*scans_, &Scans::PreviewScan, preview)->point_count(), 400);
  EXPECT_THAT(std::string(Delete("scans/s1", " ").status().message()), HasSubstr("reason"));
  EXPECT_EQ(runtime::ReasonOf(Delete("scans/s9", "wrong blade").status()), "SCAN_NOT_FOUND");
  const auto deleted = Delete("scans/s1", "wrong blade");
  ASSERT_TRUE(deleted.ok()) << deleted.status();
  EXPECT_GT(deleted->freed_bytes(), 0);
  EXPECT_TRUE(Delete("scans/s1", "again")->already_deleted());
  EXPECT_EQ(runtime::ReasonOf(Call(*scans_, &Scans::PreviewScan, preview).status()), "POINTS_DELETED");
  EXPECT_TRUE(Get("scans/s1").ok());
  v1::GetScanDeletionRequest get;
  get.set_name("deletions/s1");
  EXPECT_EQ(Call(*store_, &Store::GetScanDeletion, get)->reason(), "wrong blade");
  get.set_name("deletions/s2");
  EXPECT_EQ(runtime::ReasonOf(Call(*store_, &Store::GetScanDeletion, get).status()), "DELETION_NOT_FOUND");
}

TEST_F(IngestHandlersTest, PoliciesAreSetAndListed) {
  v1::SetRetentionPolicyRequest set;
  EXPECT_THAT(std::string(Call(*store_, &Store::SetRetentionPolicy, set).status().message()), HasSubstr("scan_kind"));
  set.set_scan_kind(v1::SCAN_KIND_PINS);
  set.set_keep_days(30);
  set.set_request_id("5f0f3c9e-6a52-4d3a-9a63-2f1d1f6f0b11");
  EXPECT_EQ(Call(*store_, &Store::SetRetentionPolicy, set)->revision(), 1);
  EXPECT_EQ(Call(*store_, &Store::SetRetentionPolicy, set)->revision(), 1);  // the same call once more
  set.clear_request_id();
  set.set_keep_days(0);
  EXPECT_EQ(Call(*store_, &Store::SetRetentionPolicy, set)->name(), "policies/pins@2");
  EXPECT_EQ(kept_->entries().back().entry.name, "policies/pins@2");
  EXPECT_THAT(kept_->entries().back().entry.requested_by, ::testing::StartsWith("ipv4:127.0.0.1:"));  // no certificate
  v1::ListRetentionPoliciesRequest list;
  EXPECT_EQ(Call(*store_, &Store::ListRetentionPolicies, list)->policies_size(), 1);
  list.set_all_revisions(true);
  list.set_page_size(1);
  const auto page = Call(*store_, &Store::ListRetentionPolicies, list);
  ASSERT_EQ(page->policies_size(), 1);
  EXPECT_EQ(page->policies(0).revision(), 2);
  list.set_page_token(page->next_page_token());
  const auto last = Call(*store_, &Store::ListRetentionPolicies, list);
  ASSERT_EQ(last->policies_size(), 1);
  EXPECT_EQ(last->policies(0).keep_days(), 30);
  EXPECT_EQ(last->next_page_token(), "");
  list.set_page_token(page->next_page_token() + "x");
  EXPECT_THAT(std::string(Call(*store_, &Store::ListRetentionPolicies, list).status().message()),
              HasSubstr("page_token"));
  EXPECT_EQ(Call(*store_, &Store::ApplyRetention, v1::ApplyRetentionRequest())->scan_count(), 0);
}

// Each reads the whole store.
TEST_F(IngestHandlersTest, TheStoreIsCheckedOnceAtATime) {
  const auto check = [&] {
    const auto context = runtime::ContextFor(10);
    const auto reader = store_->CheckStore(context.get(), {});
    for (v1::CheckStoreResponse response; reader->Read(&response);) continue;
    return runtime::FromGrpc(reader->Finish());
  };
  absl::Status second;
  blobs_->during_check = [&] { second = check(); };
  EXPECT_TRUE(check().ok());
  EXPECT_TRUE(absl::IsResourceExhausted(second)) << second;
  EXPECT_EQ(runtime::ReasonOf(second), "STORE_CHECKS_FULL");
  blobs_->during_check = nullptr;
  EXPECT_TRUE(check().ok());
}

TEST_F(IngestHandlersTest, TheStoreTellsHowItFares) {
  storage::BlobDamage damage;
  damage.sha256 = std::string(64, 'a');
  damage.store = blobs_->status.store = "s3";
  damage.what = "missing";
  blobs_->damages = {damage};
  blobs_->collected.blob_count = 7;
  v1::CheckStoreResponse last, response;
  const auto context = runtime::ContextFor(10);
  const auto reader = store_->CheckStore(context.get(), {});
  while (reader->Read(&response)) last = response;
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_TRUE(last.complete());
  EXPECT_EQ(last.damages(0).kind(), v1::DAMAGE_KIND_MISSING);
  EXPECT_EQ(Call(*store_, &Store::CollectGarbage, v1::CollectGarbageRequest())->blob_count(), 7);
  EXPECT_EQ(Call(*store_, &Store::GetStoreStatus, v1::GetStoreStatusRequest())->new_blobs(), v1::BLOB_HOLDER_S3);
}

// What the record has of a newer release, read by this one after it was rolled back.
TEST(ScanMessages, AWordOfAnotherReleaseIsNoDefault) {
  storage::ScanRow known;
  known.scan_id = "s1";
  known.blade_serial = "sn1";
  known.kind = "airfoil";
  known.v0_mm = {0, 0, 0};
  known.encoding = "xyz_f64";
  known.stored_encoding = "range_image";
  const auto scan = ToProto(known);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->header().kind(), v1::SCAN_KIND_AIRFOIL);
  EXPECT_EQ(scan->header().encoding(), v1::ENCODING_XYZ_F64);
  EXPECT_EQ(scan->stored_encoding(), v1::ENCODING_RANGE_IMAGE);
  EXPECT_EQ(scan->header().cloud(), v1::CLOUD_KIND_UNSPECIFIED);
  using Row = storage::ScanRow;
  for (std::string Row::*word :
       {&Row::kind, &Row::encoding, &Row::stored_encoding, &Row::travel, &Row::cloud, &Row::length_unit}) {
    storage::ScanRow newer = known;
    newer.*word = "volume";
    const absl::Status read = ToProto(newer).status();
    EXPECT_EQ(read.code(), absl::StatusCode::kDataLoss) << read;
    EXPECT_THAT(std::string(read.message()), HasSubstr("scan s1: its "));
    EXPECT_THAT(std::string(read.message()), HasSubstr("_VOLUME is none that this release knows"));
  }
}

TEST_F(IngestHandlersTest, AHolderOfAnotherReleaseIsNoDefault) {
  blobs_->status.store = "tape";
  EXPECT_EQ(Call(*store_, &Store::GetStoreStatus, v1::GetStoreStatusRequest()).status().code(),
            absl::StatusCode::kDataLoss);
}

TEST_F(IngestHandlersTest, SaysWhatTheStoreSays) {
  kept_->Fail(absl::UnavailableError("database: away"));
  EXPECT_EQ(Upload("s1").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Get("scans/s1").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Delete("scans/s1", "wrong blade").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Get("blades/s1").status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace sixpoint::ingest
