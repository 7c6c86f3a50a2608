// Against a real server (Ceph's radosgw); what no real server does on demand, against one of a few lines.
#include "storage/s3_object_store.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <future>
#include <mutex>
#include <thread>

#include "storage/blob_store.h"
#include "storage/blobs.h"
#include "storage/s3_answers.h"
#include "tests/support/object_store_server.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::ObjectStoreConfig;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using sixpoint::testing::WhyNoObjectStore;
using ::testing::HasSubstr;

std::string ReasonOf(const absl::Status& status) {
  const auto reason = status.GetPayload(kReasonPayload);
  return reason ? std::string(*reason) : "";
}

// Answers connection after connection with the next of its texts, the last for ever; an empty text: never answers.
class ScriptedServer {
 public:
  explicit ScriptedServer(std::vector<std::string> answers) : answers_(std::move(answers)) {
    socket_ = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(socket_, 64), 0);
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { Serve(); });
  }
  ~ScriptedServer() {
    shutdown(socket_, SHUT_RDWR);
    thread_.join();
    close(socket_);
    for (const int connection : silent_) close(connection);
  }
  std::unique_ptr<ObjectStore> Store() const {
    S3Config config;
    config.endpoint = "http://127.0.0.1:" + std::to_string(port_);
    config.bucket = "clouds";
    config.access_key = "plant";
    config.secret_key = "plant-secret";
    return MakeS3ObjectStore(config);
  }
  int served_count() const { return served_count_; }

 private:
  void Serve() {
    for (int connection; (connection = accept(socket_, nullptr, nullptr)) >= 0;) {
      const std::string& answer = answers_[std::min<size_t>(served_count_++, answers_.size() - 1)];
      if (answer.empty()) {
        silent_.push_back(connection);
        continue;
      }
      char request[65536];
      if (read(connection, request, sizeof request) > 0) {
        EXPECT_EQ(write(connection, answer.data(), answer.size()), static_cast<ssize_t>(answer.size()));
      }
      close(connection);
    }
  }
  const std::vector<std::string> answers_;
  std::atomic<int> served_count_{0};
  std::vector<int> silent_;
  int socket_ = -1, port_ = 0;
  std::thread thread_;
};

std::string Http(int status, const std::string& body) {
  return "HTTP/1.1 " + std::to_string(status) + " X\r\nContent-Length: " + std::to_string(body.size()) +
         "\r\nConnection: close\r\n\r\n" + body;
}

TEST(S3ObjectStore, TriesAgainWhatFailsByItself) {
  const ScriptedServer server({Http(503, "<Error><Code>SlowDown</Code></Error>"), Http(500, ""), Http(200, "a cloud")});
  EXPECT_EQ(*server.Store()->Get("k", 7, Soon()), "a cloud");
  EXPECT_EQ(server.served_count(), 3);
}

TEST(S3ObjectStore, GivesUpOnAServerThatKeepsFailingAndSaysSo) {
  const ScriptedServer server({Http(503, "<Error><Code>SlowDown</Code></Error>")});
  const absl::Status status = server.Store()->Get("k", 7, Soon()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
  EXPECT_EQ(ReasonOf(status), "OBJECT_STORE_AWAY");
  EXPECT_THAT(std::string(status.message()), HasSubstr("503 SlowDown"));
  EXPECT_EQ(server.served_count(), 5);
}

TEST(S3ObjectStore, DoesNotTryAgainWhatIsRefused) {
  const ScriptedServer server({Http(403, "<Error><Code>AccessDenied</Code></Error>")});
  EXPECT_EQ(ReasonOf(server.Store()->Get("k", 7, Soon()).status()), "OBJECT_STORE_REFUSED");
  EXPECT_EQ(server.served_count(), 1);
}

TEST(S3ObjectStore, TakesNoMoreBytesThanItAskedFor) {
  const ScriptedServer server({Http(200, std::string(1 << 20, 'x'))});
  const absl::Status status = server.Store()->Get("k", 7, Soon()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
}

TEST(S3ObjectStore, ASilentServerCostsNoMoreThanTheDeadline) {
  const ScriptedServer server({""});
  const auto begin = std::chrono::steady_clock::now();
  const absl::Status status = server.Store()->Get("k", 7, Soon(0.6)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded) << status;
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(1500));
}

TEST(S3ObjectStore, AServerThatIsAwayIsUnavailableWithinTheDeadline) {
  S3Config config;
  config.endpoint = "http://127.0.0.1:1";
  config.bucket = "clouds";
  config.access_key = config.secret_key = "x";
  const auto begin = std::chrono::steady_clock::now();
  const absl::Status status = MakeS3ObjectStore(config)->Put("k", "a cloud", Sha256Hex("a cloud"), Soon(5));
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
  EXPECT_EQ(ReasonOf(status), "OBJECT_STORE_AWAY");
  EXPECT_THAT(std::string(status.message()), HasSubstr("127.0.0.1:1"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST(S3Answers, AListThatIsNoneIsNotAnEmptyList) {
  EXPECT_FALSE(ReadS3List("").ok());
  EXPECT_FALSE(ReadS3List("<html>welcome</html>").ok());
  EXPECT_FALSE(ReadS3List("<ListBucketResult><IsTruncated>true</IsTruncated></ListBucketResult>").ok());
  EXPECT_FALSE(ReadS3List("<ListBucketResult><IsTruncated>false</IsTruncated><Contents><Key>a</Key></Contents>").ok());
  const auto page = ReadS3List(
      "<?xml version=\"1.0\"?><ListBucketResult xmlns=\"x\"><IsTruncated>true</IsTruncated>"
      "<NextContinuationToken>a&amp;b</NextContinuationToken><Contents><Key>sha256/&lt;</Key>"
      "<LastModified>1970-01-02T00:00:01.500Z</LastModified><Size>12</Size></Contents></ListBucketResult>");
  ASSERT_TRUE(page.ok()) << page.status();
  EXPECT_EQ(page->next, "a&b");
  ASSERT_EQ(page->objects.size(), 1u);
  EXPECT_EQ(page->objects[0].key, "sha256/<");
  EXPECT_EQ(page->objects[0].size_bytes, 12);
  EXPECT_EQ(page->objects[0].modified_at.time_since_epoch(), std::chrono::seconds(86401));
}

class RealObjectStore : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!WhyNoObjectStore().empty()) GTEST_SKIP() << WhyNoObjectStore();
    objects_ = MakeS3ObjectStore(ObjectStoreConfig());
  }
  std::unique_ptr<ObjectStore> objects_;
};

TEST_F(RealObjectStore, PutsGetsSizesListsAndDeletes) {
  std::string every_byte;
  for (int i = 0; i < 256; ++i) every_byte += static_cast<char>(i);
  const std::string large(3 << 20, 'x');  // beyond curl's own 1 MiB border for "Expect: 100-continue"
  for (const std::string& bytes : {every_byte, large, std::string()}) {
    const absl::Status put = objects_->Put("test/a", bytes, Sha256Hex(bytes), Soon());
    ASSERT_TRUE(put.ok()) << put;
    EXPECT_EQ(*objects_->SizeOf("test/a", Soon()), static_cast<std::int64_t>(bytes.size()));
    EXPECT_EQ(*objects_->Get("test/a", static_cast<std::int64_t>(bytes.size()), Soon()), bytes);
  }
  ASSERT_TRUE(objects_->Put("test/b", "b", Sha256Hex("b"), Soon()).ok());
  const auto page = objects_->List("test/", "", Soon());
  ASSERT_TRUE(page.ok()) << page.status();
  ASSERT_EQ(page->objects.size(), 2u);
  EXPECT_EQ(page->objects[1].key, "test/b");
  EXPECT_EQ(page->objects[1].size_bytes, 1);
  EXPECT_LT(std::abs((page->objects[1].modified_at - std::chrono::system_clock::now()) / std::chrono::seconds(1)), 60);
  EXPECT_TRUE(objects_->Delete("test/b", Soon()).ok());
  EXPECT_TRUE(objects_->Delete("test/b", Soon()).ok());  // again
  EXPECT_EQ(objects_->Get("test/b", 1, Soon()).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(objects_->SizeOf("test/b", Soon()).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(RealObjectStore, ListsBeyondOnePage) {
  for (int i = 0; i < 1010; ++i) {
    ASSERT_TRUE(objects_->Put("many/" + std::to_string(10000 + i), "", Sha256Hex(""), Soon()).ok());
  }
  std::string next;
  std::vector<std::string> keys;
  do {
    const auto page = objects_->List("many/", next, Soon());
    ASSERT_TRUE(page.ok()) << page.status();
    for (const ObjectStore::Listed& object : page->objects) keys.push_back(object.key);
    next = page->next;
  } while (!next.empty());
  ASSERT_EQ(keys.size(), 1010u);
  EXPECT_TRUE(std::is_sorted(keys.begin(), keys.end()));
}

TEST_F(RealObjectStore, TheServerRefusesBytesThatAreNotTheirDigest) {
  const absl::Status refused = objects_->Put("test/wrong", "a cloud", Sha256Hex("a clown"), Soon());
  EXPECT_THAT(std::string(refused.message()), HasSubstr("XAmzContentSHA256Mismatch"));
  EXPECT_EQ(objects_->SizeOf("test/wrong", Soon()).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(RealObjectStore, WrongKeysAndAMissingBucketSayWhatIsWanted) {
  S3Config stranger = ObjectStoreConfig();
  stranger.secret_key = "guessed";
  S3Config nobody = ObjectStoreConfig();
  nobody.access_key = "nobody";
  for (const S3Config& config : {stranger, nobody}) {
    const auto objects = MakeS3ObjectStore(config);
    for (const absl::Status& status : {objects->Put("k", "b", Sha256Hex("b"), Soon()),
                                       objects->Get("k", 1, Soon()).status(), objects->SizeOf("k", Soon()).status()}) {
      EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
      EXPECT_EQ(ReasonOf(status), "OBJECT_STORE_REFUSED");
      EXPECT_THAT(std::string(status.message()), ::testing::Not(HasSubstr("guessed")));
    }
  }
  S3Config elsewhere = ObjectStoreConfig();
  elsewhere.bucket = "no-such-bucket";
  const absl::Status missing = MakeS3ObjectStore(elsewhere)->Put("k", "b", Sha256Hex("b"), Soon());
  EXPECT_EQ(missing.code(), absl::StatusCode::kFailedPrecondition) << missing;
  EXPECT_EQ(ReasonOf(missing), "BUCKET_MISSING");
  EXPECT_EQ(ReasonOf(MakeS3ObjectStore(elsewhere)->Get("k", 1, Soon()).status()), "BUCKET_MISSING");
}

// Another's object store that can be made to stand still.
class ObjectStoreGate {
 public:
  std::unique_ptr<ObjectStore> Open() { return std::make_unique<Gated>(this); }
  void Close() { Set(true); }
  void Release() { Set(false); }
  void AwaitHeld(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return held_ >= count; });
  }

 private:
  class Gated final : public ObjectStore {
   public:
    explicit Gated(ObjectStoreGate* gate) : gate_(gate) {}
    absl::Status Put(const std::string& key, std::string_view bytes, const std::string& sha256,
                     Deadline deadline) override {
      gate_->Pass();
      return real_->Put(key, bytes, sha256, deadline);
    }
    absl::StatusOr<std::string> Get(const std::string& key, std::int64_t greatest_bytes, Deadline deadline) override {
      gate_->Pass();
      return real_->Get(key, greatest_bytes, deadline);
    }
    absl::StatusOr<std::int64_t> SizeOf(const std::string& key, Deadline deadline) override {
      gate_->Pass();
      return real_->SizeOf(key, deadline);
    }
    absl::Status Delete(const std::string& key, Deadline deadline) override {
      gate_->Pass();
      return real_->Delete(key, deadline);
    }
    absl::StatusOr<ListPage> List(const std::string& prefix, const std::string& next, Deadline deadline) override {
      gate_->Pass();
      return real_->List(prefix, next, deadline);
    }

   private:
    ObjectStoreGate* const gate_;
    const std::unique_ptr<ObjectStore> real_ = MakeS3ObjectStore(ObjectStoreConfig());
  };
  void Set(bool closed) {
    std::lock_guard lock(mutex_);
    closed_ = closed;
    changed_.notify_all();
  }
  void Pass() {
    std::unique_lock lock(mutex_);
    ++held_;
    changed_.notify_all();
    changed_.wait(lock, [&] { return !closed_; });
    --held_;
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  bool closed_ = false;
  int held_ = 0;
};

class ObjectBlobs : public RealObjectStore {
 protected:
  void SetUp() override {
    RealObjectStore::SetUp();
    if (IsSkipped()) return;
    database_ = std::make_unique<ThrowawayDatabase>();
    store_ = MakeObjectBlobStore(MakeS3ObjectStore(ObjectStoreConfig()));
  }
  Transaction Begin() { return std::move(database_->database()->Begin(Soon())).value(); }
  std::string Put(const std::string& bytes) { return PutIn(*store_, bytes); }
  std::string PutIn(BlobStore& store, const std::string& bytes) {
    const absl::StatusOr<StagedBlob> staged = store.Stage(*database_->database(), bytes, Soon());
    EXPECT_TRUE(staged.ok()) << staged.status();
    if (!staged.ok()) return "";
    Transaction transaction = Begin();
    const absl::Status put = store.Put(transaction, *staged);
    EXPECT_TRUE(put.ok()) << put;
    EXPECT_TRUE(transaction.Commit().ok());
    return staged->sha256;
  }
  absl::StatusOr<std::string> Get(const std::string& sha256) {
    return store_->Get(*database_->database(), sha256, Soon());
  }
  std::string KeyOf(const std::string& sha256) {
    Transaction transaction = Begin();
    const auto rows = transaction.Execute("SELECT object_id FROM blobs WHERE sha256 = $1", Params().Digest(sha256));
    return ObjectKeyOf(sha256, rows->Text(0, 0));
  }
  std::unique_ptr<ThrowawayDatabase> database_;
  std::unique_ptr<BlobStore> store_;
};

TEST_F(ObjectBlobs, BytesAreAnObjectAndTheRowSaysSo) {
  const std::string sha256 = Put("a cloud");
  EXPECT_EQ(Put("a cloud"), sha256);
  EXPECT_EQ(*Get(sha256), "a cloud");
  const std::string key = KeyOf(sha256);
  EXPECT_EQ(key.substr(0, 78), "sha256/" + sha256.substr(0, 2) + "/" + sha256.substr(2, 2) + "/" + sha256 + "/");
  EXPECT_EQ(*objects_->Get(key, 7, Soon()), "a cloud");
  Transaction transaction = Begin();
  const auto rows = transaction.Execute("SELECT store, bytes IS NULL, size_bytes, count(*) OVER () FROM blobs");
  EXPECT_EQ(rows->Text(0, 0), "s3");
  EXPECT_TRUE(rows->Bool(0, 1));
  EXPECT_EQ(rows->Int(0, 2), 7);
  EXPECT_EQ(rows->Int(0, 3), 1);
}

TEST_F(ObjectBlobs, ACorruptedObjectIsDataLossWhateverItsLength) {
  const std::string sha256 = Put("cloud to corrupt");
  for (const std::string other : {"cloud to corrupT", "cloud", "cloud to corrupt and more", ""}) {
    ASSERT_TRUE(objects_->Put(KeyOf(sha256), other, Sha256Hex(other), Soon()).ok());
    const absl::Status status = Get(sha256).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << other << ": " << status;
  }
}

TEST_F(ObjectBlobs, AnObjectDeletedBehindOurBackIsDataLossUntilItComesAgain) {
  const std::string sha256 = Put("cloud to lose");
  ASSERT_TRUE(objects_->Delete(KeyOf(sha256), Soon()).ok());
  const absl::Status status = Get(sha256).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("missing from store s3"));
  EXPECT_EQ(Put("cloud to lose"), sha256);
  EXPECT_EQ(*Get(sha256), "cloud to lose");
}

TEST_F(ObjectBlobs, APlantThatChangedStoresReadsBoth) {
  const auto before = MakePostgresqlBlobStore();
  const std::string old = PutIn(*before, "an old cloud");
  const std::string young = Put("a young cloud");
  EXPECT_EQ(Put("an old cloud"), old);  // stays where it is
  EXPECT_EQ(*Get(old), "an old cloud");
  EXPECT_EQ(*Get(young), "a young cloud");
  const auto back = MakePostgresqlBlobStore(MakeS3ObjectStore(ObjectStoreConfig()));
  EXPECT_EQ(*back->Get(*database_->database(), young, Soon()), "a young cloud");
}

TEST_F(ObjectBlobs, NoRowIsSeenOfATransactionThatWasRolledBack) {
  const std::string bytes = "cloud of a failed upload";
  const StagedBlob staged = *store_->Stage(*database_->database(), bytes, Soon());
  {
    Transaction transaction = Begin();
    ASSERT_TRUE(store_->Put(transaction, staged).ok());
  }
  EXPECT_EQ(Get(staged.sha256).status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(objects_->SizeOf(ObjectKeyOf(staged.sha256, staged.object_id), Soon()).ok());  // left to the collector
}

// An object store that does not answer holds neither a connection nor a transaction: there is only one, and others have it.
TEST_F(ObjectBlobs, NoConnectionIsHeldWhileTheObjectStoreIsWaitedFor) {
  const std::string sha256 = Put("a cloud");
  const auto single = database_->Open(1);
  ObjectStoreGate gate;  // lets no request through while it is closed
  const auto slow = MakeObjectBlobStore(gate.Open());
  ASSERT_TRUE(slow->Stage(*single, "first", Soon()).ok());
  gate.Close();
  std::future<absl::StatusOr<StagedBlob>> stage =
      std::async(std::launch::async, [&] { return slow->Stage(*single, "another cloud", Soon(20)); });
  std::future<absl::StatusOr<std::string>> get =
      std::async(std::launch::async, [&] { return slow->Get(*single, sha256, Soon(20)); });
  gate.AwaitHeld(2);
  EXPECT_TRUE(single->Begin(Soon(1)).ok());
  gate.Release();
  EXPECT_TRUE(stage.get().ok());
  EXPECT_EQ(*get.get(), "a cloud");
}

}  // namespace
}  // namespace sixpoint::storage
