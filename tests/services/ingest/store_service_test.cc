// The keeping of the store over real gRPC on a real PostgreSQL.
#include "services/ingest/store_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/blobs.h"
#include "storage/record.h"
#include "tests/support/in_process_server.h"
#include "tests/support/stored_scan.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::ingest {
namespace {

using ::testing::HasSubstr;
using Stub = v1::CloudStoreService::Stub;

class StoreServiceTest : public ::testing::Test {
 protected:
  StoreServiceTest()
      : store_(storage::MakePostgresqlBlobStore()),
        service_(storage::RetentionIn(database_.database(), store_),
                 storage::BlobKeepingIn(database_.database(), store_)),
        server_({&service_}),
        stub_(v1::CloudStoreService::NewStub(server_.Connect())) {
    testing::PutScanSubjects(database_.database());
  }
  void PutScan(const std::string& scan_id, const std::vector<std::string>& blocks, int days_ago = 0) {
    testing::PutScan(database_.database(), store_.get(), scan_id, "artefact", blocks, days_ago);
  }
  storage::Rows Execute(const std::string& sql) {
    auto transaction = database_.database()->Begin(testing::Soon());
    EXPECT_TRUE(transaction.ok()) << transaction.status();
    auto rows = transaction->Execute(sql);
    EXPECT_TRUE(rows.ok()) << sql << ": " << rows.status();
    EXPECT_TRUE(transaction->Commit().ok());
    return rows.ok() ? *rows : storage::Rows();
  }
  void FlipABitOf(const std::string& bytes) {
    Execute("ALTER TABLE blobs DISABLE TRIGGER USER");
    Execute("UPDATE blobs SET bytes = set_bit(bytes, 3, 1 - get_bit(bytes, 3)) WHERE sha256 = '\\x" +
            storage::Sha256Hex(bytes) + "'");
    Execute("ALTER TABLE blobs ENABLE TRIGGER USER");
  }
  template <typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                                const Request& request) {
    const auto context = runtime::ContextFor(20);
    Response response;
    const absl::Status status = runtime::FromGrpc((stub_.get()->*method)(context.get(), request, &response));
    if (!status.ok()) return status;
    return response;
  }
  absl::StatusOr<v1::DeleteScanPointsResponse> Delete(const std::string& name, const std::string& reason) {
    v1::DeleteScanPointsRequest request;
    request.set_name(name);
    request.set_reason(reason);
    return Call(&Stub::DeleteScanPoints, request);
  }
  std::vector<v1::CheckStoreResponse> Check(const v1::CheckStoreRequest& request, absl::Status* status) {
    const auto context = runtime::ContextFor(20);
    const auto reader = stub_->CheckStore(context.get(), request);
    std::vector<v1::CheckStoreResponse> responses;
    v1::CheckStoreResponse response;
    while (reader->Read(&response)) responses.push_back(response);
    *status = runtime::FromGrpc(reader->Finish());
    return responses;
  }

  testing::ThrowawayDatabase database_;
  const std::shared_ptr<storage::BlobStore> store_;
  CloudStoreService service_;
  testing::InProcessServer server_;
  std::unique_ptr<Stub> stub_;
};

TEST_F(StoreServiceTest, ACheckTellsWhatItReadAndWhatIsDamaged) {
  PutScan("s1", {"first", "second", "third"});
  FlipABitOf("second");
  absl::Status status;
  const auto responses = Check(v1::CheckStoreRequest(), &status);
  ASSERT_TRUE(status.ok()) << status;
  ASSERT_EQ(responses.size(), 1u);
  EXPECT_TRUE(responses[0].complete());
  EXPECT_EQ(responses[0].checked_count(), 3);
  EXPECT_EQ(responses[0].checked_bytes(), 16);
  EXPECT_EQ(responses[0].damaged_count(), 1);
  ASSERT_EQ(responses[0].damages_size(), 1);
  EXPECT_EQ(responses[0].damages(0).sha256(), storage::Sha256Hex("second"));
  EXPECT_EQ(responses[0].damages(0).kind(), v1::DAMAGE_KIND_DIGEST);
  const auto now = Call(&Stub::GetStoreStatus, v1::GetStoreStatusRequest());
  ASSERT_TRUE(now.ok()) << now.status();
  EXPECT_EQ(now->new_blobs(), v1::BLOB_HOLDER_POSTGRESQL);
  ASSERT_EQ(now->uses_size(), 1);
  EXPECT_EQ(now->uses(0).kept_count(), 3);
  EXPECT_EQ(now->uses(0).kept_bytes(), 16);
  ASSERT_EQ(now->damages_size(), 1);
  EXPECT_FALSE(now->has_check_finished_at());  // that is the continuous check's
}

TEST_F(StoreServiceTest, ASlowCheckSendsProgressAndGoesOnFromWhereItStopped) {
  PutScan("s1",
          {std::string(300'000, 'a'), std::string(300'000, 'b'), std::string(300'000, 'c'), std::string(300'000, 'd')});
  v1::CheckStoreRequest request;
  request.set_rate_mb_s(0.5);
  const auto context = runtime::ContextFor(1.6);
  const auto reader = stub_->CheckStore(context.get(), request);
  v1::CheckStoreResponse last, response;
  while (reader->Read(&response)) last = response;
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  ASSERT_GT(last.checked_count(), 0);
  ASSERT_LT(last.checked_count(), 4);
  request.set_rate_mb_s(0);
  request.set_after_sha256(last.after_sha256());
  absl::Status status;
  auto rest = Check(request, &status);
  // The first one may not have ended yet: it hears of its end when it looks next.
  for (const auto end = testing::Soon(10); absl::IsResourceExhausted(status) && std::chrono::steady_clock::now() < end;)
    rest = Check(request, &status);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(rest.back().checked_count() + last.checked_count(), 4);
  EXPECT_TRUE(rest.back().complete());
}

TEST_F(StoreServiceTest, CollectionLeavesWhatIsYoungAndWhatIsUsed) {
  PutScan("s1", {"used"});
  testing::PutCloud(database_.database(), store_.get(), "unused");
  EXPECT_EQ(Call(&Stub::CollectGarbage, v1::CollectGarbageRequest())->blob_count(), 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  v1::CollectGarbageRequest request;
  request.set_grace_s(1);
  request.set_dry_run(true);
  EXPECT_EQ(Call(&Stub::CollectGarbage, request)->blob_bytes(), 6);
  request.set_dry_run(false);
  EXPECT_EQ(Call(&Stub::CollectGarbage, request)->blob_count(), 1);
  EXPECT_EQ(Call(&Stub::CollectGarbage, request)->blob_count(), 0);
}

TEST_F(StoreServiceTest, DeletedPointsAreAnEntryInTheRecord) {
  PutScan("s1", {"points"});
  const auto deleted = Delete("scans/s1", "wrong blade in the nest");
  ASSERT_TRUE(deleted.ok()) << deleted.status();
  EXPECT_EQ(deleted->deletion().scan(), "scans/s1");
  EXPECT_EQ(deleted->deletion().points_sha256(), storage::Sha256Hex("points"));
  EXPECT_THAT(deleted->deletion().requested_by(), ::testing::StartsWith("ipv4:127.0.0.1:"));  // no door, no certificate
  EXPECT_EQ(deleted->deletion().policy_kind(), v1::SCAN_KIND_UNSPECIFIED);
  EXPECT_EQ(deleted->freed_bytes(), 6);
  v1::GetScanDeletionRequest get;
  get.set_name("deletions/s1");
  const auto got = Call(&Stub::GetScanDeletion, get);
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ(got->name(), "deletions/s1");
  EXPECT_EQ(got->reason(), "wrong blade in the nest");
  get.set_name("deletions/none");
  EXPECT_EQ(Call(&Stub::GetScanDeletion, get).status().code(), absl::StatusCode::kNotFound);
  const auto again = Delete("scans/s1", "another reason");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->already_deleted());
  EXPECT_EQ(again->deletion().reason(), "wrong blade in the nest");
  const storage::Rows entry = Execute(
      "SELECT kind, summary->>'reason' FROM record_entries JOIN record_names USING (record_id) "
      "WHERE name = 'deletions/s1'");
  ASSERT_EQ(entry.count(), 1);
  EXPECT_EQ(entry.Text(0, 0), "deletion");
  EXPECT_EQ(entry.Text(0, 1), "wrong blade in the nest");
}

TEST_F(StoreServiceTest, PoliciesAreRevisionsAndAreApplied) {
  PutScan("old", {"old points"}, 40);
  PutScan("young", {"young points"}, 3);
  v1::SetRetentionPolicyRequest set;
  set.set_scan_kind(v1::SCAN_KIND_ARTEFACT);
  EXPECT_EQ(Call(&Stub::SetRetentionPolicy, set)->keep_days(), 0);
  set.set_keep_days(30);
  EXPECT_EQ(Call(&Stub::SetRetentionPolicy, set)->revision(), 2);
  v1::ListRetentionPoliciesRequest list;
  EXPECT_EQ(Call(&Stub::ListRetentionPolicies, list)->policies_size(), 1);
  list.set_all_revisions(true);
  EXPECT_EQ(Call(&Stub::ListRetentionPolicies, list)->policies_size(), 2);
  EXPECT_EQ(Execute("SELECT count(*) FROM record_entries e JOIN record_names n USING (record_id) "
                    "JOIN retention_policies p USING (record_id) "
                    "WHERE n.name = 'policies/artefact@' || p.revision AND e.kind = 'policy'")
                .Int(0, 0),
            2);
  v1::ApplyRetentionRequest apply;
  apply.set_dry_run(true);
  EXPECT_EQ(Call(&Stub::ApplyRetention, apply)->scan_count(), 1);
  apply.set_dry_run(false);
  const auto done = Call(&Stub::ApplyRetention, apply);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->scan_count(), 1);
  EXPECT_EQ(done->freed_bytes(), 10);
  const auto deletion = Delete("scans/old", "again");
  EXPECT_TRUE(deletion->already_deleted());
  EXPECT_EQ(deletion->deletion().policy_revision(), 2);
  EXPECT_EQ(deletion->deletion().policy_kind(), v1::SCAN_KIND_ARTEFACT);
  EXPECT_FALSE(Delete("scans/young", "by hand")->already_deleted());
}

TEST_F(StoreServiceTest, RefusalsNameTheField) {
  PutScan("s1", {"points"});
  const auto expect_refused = [](const absl::Status& status, const std::string& field) {
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(field + ": "));
    EXPECT_THAT(std::string(status.message()), HasSubstr("want "));
  };
  expect_refused(Delete("s1", "why").status(), "name");
  expect_refused(Delete("scans/s1", " ").status(), "reason");
  EXPECT_EQ(Delete("scans/none", "why").status().code(), absl::StatusCode::kNotFound);
  v1::SetRetentionPolicyRequest set;
  set.set_keep_days(1);
  expect_refused(Call(&Stub::SetRetentionPolicy, set).status(), "scan_kind");
  set.set_scan_kind(v1::SCAN_KIND_ARM);
  for (const int keep_days : {-1, 40'000}) {
    set.set_keep_days(keep_days);
    expect_refused(Call(&Stub::SetRetentionPolicy, set).status(), "keep_days");
  }
  v1::CollectGarbageRequest collect;
  collect.set_grace_s(-1);
  expect_refused(Call(&Stub::CollectGarbage, collect).status(), "grace_s");
  v1::CheckStoreRequest check;
  absl::Status status;
  check.set_after_sha256("abc");
  Check(check, &status);
  expect_refused(status, "after_sha256");
  check.clear_after_sha256();
  check.set_rate_mb_s(-1);
  Check(check, &status);
  expect_refused(status, "rate_mb_s");
}

// In the background: retention, collection and the check come by themselves, and the end does not wait for them.
TEST_F(StoreServiceTest, TheKeeperDoesAllThisByItself) {
  PutScan("old", {"old points"}, 40);
  PutScan("young", {"young points", "to damage"}, 3);
  FlipABitOf("to damage");
  v1::SetRetentionPolicyRequest set;
  set.set_scan_kind(v1::SCAN_KIND_ARTEFACT);
  set.set_keep_days(30);
  ASSERT_TRUE(Call(&Stub::SetRetentionPolicy, set).ok());
  StoreKeeperOptions options;
  options.every = std::chrono::seconds(1);
  options.check_rate_mb_s = 100;
  {
    const StoreKeeper keeper(options, database_.conninfo(), store_);
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (
        std::chrono::steady_clock::now() < give_up &&
        Execute("SELECT count(*) FROM scan_deletions, blob_damages, blob_check_progress WHERE finished_at IS NOT NULL")
                .Int(0, 0) == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  EXPECT_EQ(Execute("SELECT scan_id FROM scan_deletions JOIN scans USING (scan_key)").Text(0, 0), "old");
  EXPECT_EQ(Execute("SELECT sha256 FROM blob_damages").Digest(0, 0), storage::Sha256Hex("to damage"));
  EXPECT_TRUE(Call(&Stub::GetStoreStatus, v1::GetStoreStatusRequest())->has_check_finished_at());

  options.check_rate_mb_s = 1e-6;  // would take hours
  Execute("UPDATE blob_check_progress SET finished_at = NULL");
  const auto begin = std::chrono::steady_clock::now();
  {
    const StoreKeeper keeper(options, database_.conninfo(), store_);
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(3));
}

}  // namespace
}  // namespace sixpoint::ingest
