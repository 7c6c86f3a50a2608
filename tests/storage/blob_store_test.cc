#include "storage/blob_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "storage/blobs.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using ::testing::HasSubstr;

class BlobStoreTest : public ::testing::Test {
 protected:
  Transaction Begin() { return std::move(database_.database()->Begin(Soon())).value(); }
  std::string Put(const std::string& bytes) {
    const absl::StatusOr<StagedBlob> staged = store_->Stage(*database_.database(), bytes, Soon());
    EXPECT_TRUE(staged.ok()) << staged.status();
    if (!staged.ok()) return "";
    Transaction transaction = Begin();
    const absl::Status put = store_->Put(transaction, *staged);
    EXPECT_TRUE(put.ok()) << put;
    EXPECT_TRUE(transaction.Commit().ok());
    return staged->sha256;
  }
  absl::StatusOr<std::string> Get(const std::string& sha256) {
    return store_->Get(*database_.database(), sha256, Soon());
  }
  // With the setting that announces the change; empty: none.
  absl::Status Change(const std::string& purpose, const std::string& sql) {
    Transaction transaction = Begin();
    if (!purpose.empty()) {
      const auto announced =
          transaction.Execute("SELECT set_config('sixpoint.blob_change', $1, true)", Params().Text(purpose));
      if (!announced.ok()) return announced.status();
    }
    if (const auto changed = transaction.Execute(sql); !changed.ok()) return changed.status();
    return transaction.Commit();
  }
  absl::Status Delete(const std::string& sha256) {
    return Change("delete_bytes",
                  "UPDATE blobs SET bytes = NULL, deleted_at = now(), deletion_reason = 'a test' WHERE sha256 = '\\x" +
                      sha256 + "'");
  }

  ThrowawayDatabase database_;
  std::unique_ptr<BlobStore> store_ = MakePostgresqlBlobStore();
};

TEST_F(BlobStoreTest, GivesBackAnyBytes) {
  std::string every_byte;
  for (int i = 0; i < 256; ++i) every_byte += static_cast<char>(i);
  for (const std::string& bytes : {std::string(), std::string("\\x41"), every_byte, std::string(3 << 20, '\0')}) {
    EXPECT_EQ(*Get(Put(bytes)), bytes);
  }
  EXPECT_EQ(Get(std::string(64, '0')).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(BlobStoreTest, DeletedBytesSayWhenAndWhy) {
  const std::string sha256 = Put("a cloud");
  ASSERT_TRUE(Delete(sha256).ok());
  const absl::Status deleted = Get(sha256).status();
  EXPECT_EQ(deleted.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(deleted.GetPayload(kReasonPayload), absl::Cord("POINTS_DELETED"));
  EXPECT_THAT(std::string(deleted.message()), HasSubstr("deleted at 20"));
  EXPECT_THAT(std::string(deleted.message()), HasSubstr("reason: a test"));
}

TEST_F(BlobStoreTest, DeletedBytesThatComeAgainAreBack) {
  const std::string sha256 = Put("a cloud");
  ASSERT_TRUE(Delete(sha256).ok());
  EXPECT_EQ(Put("a cloud"), sha256);
  EXPECT_EQ(*Get(sha256), "a cloud");
}

TEST_F(BlobStoreTest, NoOtherChangeIsAllowedWhateverIsAnnounced) {
  const std::string kept = Put("a cloud");
  const std::string gone = Put("another cloud");
  ASSERT_TRUE(Delete(gone).ok());
  const std::string of_kept = " WHERE sha256 = '\\x" + kept + "'", of_gone = " WHERE sha256 = '\\x" + gone + "'";
  const std::string drop = "UPDATE blobs SET bytes = NULL, deleted_at = now(), deletion_reason = 'x'";
  const std::pair<std::string, std::string> refused[] = {
      {"", "DELETE FROM blobs"},
      {"", drop + of_kept},
      {"", "UPDATE blobs SET bytes = 'another cloud', deleted_at = NULL, deletion_reason = NULL" + of_gone},
      {"delete_bytes", "DELETE FROM blobs"},
      {"delete_bytes", "UPDATE blobs SET bytes = 'a clown'" + of_kept},
      {"delete_bytes", drop + ", size_bytes = 1" + of_kept},
      {"delete_bytes", drop + ", sha256 = '\\x" + std::string(64, '0') + "'" + of_kept},
      {"delete_bytes", drop + ", store = 's3'" + of_kept},
      {"delete_bytes", "UPDATE blobs SET deletion_reason = 'other'" + of_gone},
      {"restore_bytes",
       "UPDATE blobs SET bytes = 'another clown', deleted_at = NULL, deletion_reason = NULL" + of_gone},
      {"restore_bytes", "UPDATE blobs SET bytes = 'a clown'" + of_kept},
      {"collect", drop + of_kept},
      {"collect", "TRUNCATE blobs CASCADE"},
  };
  for (const auto& [purpose, sql] : refused) {
    const absl::Status status = Change(purpose, sql);
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << purpose << ": " << sql << ": " << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("append-only")) << sql;
  }
  EXPECT_TRUE(Change("collect", "DELETE FROM blobs" + of_kept).ok());
}

TEST_F(BlobStoreTest, AStateThatContradictsItselfIsRefused) {
  const std::string digest(64, 'a');
  const std::string object = ", gen_random_uuid()", none = ", NULL";
  for (const std::string& values : {"NULL, 'postgresql', NULL, NULL" + none, "'a cloud', 's3', NULL, NULL" + object,
                                    "NULL, 's3', now(), NULL" + object, "NULL, 's3', NULL, 'why'" + object,
                                    "'a cloud', 'postgresql', now(), 'why'" + none, "NULL, 'tape', NULL, NULL" + none,
                                    "NULL, 's3', now(), ''" + object, "NULL, 's3', NULL, NULL" + none,
                                    "'a cloud', 'postgresql', NULL, NULL" + object}) {
    const absl::Status status = Change("",
                                       "INSERT INTO blobs (sha256, size_bytes, bytes, store, deleted_at, "
                                       "deletion_reason, object_id) VALUES ('\\x" +
                                           digest + "', 7, " + values + ")");
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << values << ": " << status;
  }
}

// Put waits for whoever deletes the row, sees that it went, and puts it again.
TEST_F(BlobStoreTest, APutThatMeetsADeletionKeepsTheBytes) {
  for (const char* change :
       {"DELETE FROM blobs WHERE sha256 = $1",
        "UPDATE blobs SET bytes = NULL, deleted_at = now(), deletion_reason = 'x' WHERE sha256 = $1"}) {
    const std::string sha256 = Put("a cloud");
    Transaction deletion = Begin();
    const std::string purpose = change[0] == 'D' ? "collect" : "delete_bytes";
    ASSERT_TRUE(deletion.Execute("SELECT set_config('sixpoint.blob_change', '" + purpose + "', true)").ok());
    ASSERT_TRUE(deletion.Execute("SELECT 1 FROM blobs WHERE sha256 = $1 FOR UPDATE", Params().Digest(sha256)).ok());
    ASSERT_TRUE(deletion.Execute(change, Params().Digest(sha256)).ok());
    std::future<std::string> put = std::async(std::launch::async, [this] { return Put("a cloud"); });
    EXPECT_EQ(put.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout) << "Put did not wait";
    ASSERT_TRUE(deletion.Commit().ok());
    EXPECT_EQ(put.get(), sha256);
    EXPECT_EQ(*Get(sha256), "a cloud") << change;
  }
}

TEST_F(BlobStoreTest, NoMoreCloudsThanPostgresqlMayHold) {
  Put(std::string(600, 'a'));
  const auto full = MakePostgresqlBlobStore(nullptr, 1000);
  ASSERT_TRUE(full->Stage(*database_.database(), "small", Soon()).ok());
  Put(std::string(400, 'b'));
  const absl::Status refused =
      MakePostgresqlBlobStore(nullptr, 1000)->Stage(*database_.database(), "small", Soon()).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted) << refused;
  EXPECT_EQ(refused.message(),
            "clouds in PostgreSQL: 1000 bytes, want less than 1000: an object store (--blob-store), or a retention "
            "policy");
  ASSERT_TRUE(Delete(Sha256Hex(std::string(400, 'b'))).ok());  // as retention does
  EXPECT_TRUE(MakePostgresqlBlobStore(nullptr, 1000)->Stage(*database_.database(), "small", Soon()).ok());
}

TEST_F(BlobStoreTest, WithoutItsObjectStoreABlobThereIsNamedNotLost) {
  const std::string sha256 = Sha256Hex("a cloud");
  ASSERT_TRUE(Change("", "INSERT INTO blobs (sha256, size_bytes, store, object_id) VALUES ('\\x" + sha256 +
                             "', 7, 's3', gen_random_uuid())")
                  .ok());
  const absl::Status status = Get(sha256).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.GetPayload(kReasonPayload), absl::Cord("OBJECT_STORE_MISSING"));
  EXPECT_EQ(Put("a cloud"), sha256);  // comes home
  EXPECT_EQ(*Get(sha256), "a cloud");
}

}  // namespace
}  // namespace sixpoint::storage
