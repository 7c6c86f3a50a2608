// Collector, check and retention over both stores: each test runs on PostgreSQL and on a real S3 server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <random>
#include <set>
#include <thread>

#include "storage/blob_check.h"
#include "storage/blob_collector.h"
#include "storage/blob_store.h"
#include "storage/blobs.h"
#include "storage/bucket_owner.h"
#include "storage/record.h"
#include "storage/retention.h"
#include "storage/s3_object_store.h"
#include "storage/scans.h"
#include "tests/support/object_store_server.h"
#include "tests/support/stored_scan.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::ObjectStoreConfig;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using sixpoint::testing::WhyNoObjectStore;
using ::testing::HasSubstr;

class BlobKeepingTest : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (OnS3()) {
      if (!WhyNoObjectStore().empty()) GTEST_SKIP() << WhyNoObjectStore();
      store_ = MakeObjectBlobStore(MakeS3ObjectStore(ObjectStoreConfig()));
    } else {
      store_ = MakePostgresqlBlobStore();
    }
    // As a later migration might: nothing else tells the collector of it.
    Run("CREATE TABLE uses (sha256 bytea NOT NULL REFERENCES blobs (sha256))");
    sixpoint::testing::PutScanSubjects(database());
    if (!OnS3()) return;
    const absl::Status own = RequireOwnBucket(*database(), store_->objects(), Soon());
    ASSERT_TRUE(own.ok()) << own;
  }
  void TearDown() override {
    if (store_ == nullptr || !OnS3()) return;
    // The bucket outlives the test's database: to the next one, all of it would be garbage.
    const ObjectStore::ListPage page = store_->objects()->List("sha256/", "", Soon()).value();
    for (const ObjectStore::Listed& object : page.objects) {
      EXPECT_TRUE(store_->objects()->Delete(object.key, Soon()).ok());
    }
  }
  bool OnS3() const { return GetParam() == std::string("s3"); }
  Database* database() { return database_.database(); }
  Transaction Begin() { return std::move(database()->Begin(Soon(60))).value(); }
  Rows Run(const std::string& sql) {
    Transaction transaction = Begin();
    absl::StatusOr<Rows> rows = transaction.Execute(sql);
    EXPECT_TRUE(rows.ok()) << sql << ": " << rows.status();
    EXPECT_TRUE(transaction.Commit().ok());
    return rows.ok() ? *rows : Rows();
  }
  std::string PutIn(Transaction& transaction, const std::string& bytes) {
    const absl::StatusOr<StagedBlob> staged = store_->Stage(*database(), bytes, Soon(60));
    EXPECT_TRUE(staged.ok()) << staged.status();
    if (!staged.ok()) return "";
    const absl::Status put = store_->Put(transaction, *staged);
    EXPECT_TRUE(put.ok()) << put;
    return staged->sha256;
  }
  std::string Put(const std::string& bytes, bool used) {
    Transaction transaction = Begin();
    const std::string sha256 = PutIn(transaction, bytes);
    if (used) {
      const auto use = transaction.Execute("INSERT INTO uses VALUES ($1)", Params().Digest(sha256));
      EXPECT_TRUE(use.ok()) << use.status();
    }
    const absl::Status committed = transaction.Commit();
    EXPECT_TRUE(committed.ok()) << committed;
    return sha256;
  }
  absl::StatusOr<std::string> Get(const std::string& sha256) { return store_->Get(*database(), sha256, Soon(60)); }
  // Of the object that the row claims, or claimed when its bytes were deleted.
  std::string KeyOf(const std::string& sha256) {
    const Rows rows = Run("SELECT object_id FROM blobs WHERE sha256 = '\\x" + sha256 + "'");
    EXPECT_EQ(rows.count(), 1) << sha256;
    return rows.count() == 1 ? ObjectKeyOf(sha256, rows.Text(0, 0)) : "";
  }
  Collected Collect(std::chrono::seconds grace, bool dry_run = false,
                    std::chrono::seconds object_grace = std::chrono::seconds(0)) {
    CollectOptions options;
    options.grace = grace;
    options.object_grace = object_grace;
    options.dry_run = dry_run;
    const absl::StatusOr<Collected> collected = CollectGarbage(database(), store_->objects(), options, Soon(60));
    EXPECT_TRUE(collected.ok()) << collected.status();
    return collected.value_or(Collected());
  }
  void PutScan(const std::string& scan_id, const std::string& kind, const std::vector<std::string>& blocks,
               int days_ago) {
    sixpoint::testing::PutScan(database(), store_.get(), scan_id, kind, blocks, days_ago);
  }
  absl::Status PointsOf(const std::string& scan_id) {
    Transaction transaction = Begin();
    return RequirePoints(transaction, scan_id);
  }
  void SetPolicy(const std::string& kind, std::optional<int> keep_days) {
    Transaction transaction = Begin();
    RecordEntry entry;
    entry.software_version = "test";
    const auto set = SetRetentionPolicy(transaction, {kind, 0, keep_days, "a tester", {}}, entry);
    EXPECT_TRUE(set.ok()) << set.status();
    EXPECT_TRUE(transaction.Commit().ok());
  }
  RetentionDone Apply(bool dry_run = false) {
    RetentionOptions options;
    options.software_version = "test";
    options.requested_by = "keeper";
    options.dry_run = dry_run;
    const auto done = ApplyRetention(database(), store_->objects(), options, Soon(60));
    EXPECT_TRUE(done.ok()) << done.status();
    return done.value_or(RetentionDone());
  }
  DeletedPoints Delete(const std::string& scan_id) {
    const auto deleted = DeleteScanPoints(database(), store_->objects(),
                                          {scan_id, "a \"test\"", "a tester", "test", std::nullopt}, Soon(60));
    EXPECT_TRUE(deleted.ok()) << deleted.status();
    return deleted.value_or(DeletedPoints());
  }
  bool ObjectIsThere(const std::string& key) { return store_->objects()->SizeOf(key, Soon()).ok(); }

  ThrowawayDatabase database_;
  std::unique_ptr<BlobStore> store_;
};
INSTANTIATE_TEST_SUITE_P(Stores, BlobKeepingTest, ::testing::Values("postgresql", "s3"));

TEST_P(BlobKeepingTest, CollectsWhatNothingRefersToAfterTheGrace) {
  const std::string used = Put("used", true), unused = Put("unused", false);
  PutScan("s1", "artefact", {"block"}, 0);
  const std::string key = OnS3() ? KeyOf(unused) : "";
  EXPECT_EQ(Collect(std::chrono::hours(24)).blob_count, 0);
  EXPECT_EQ(Collect(std::chrono::seconds(0), /*dry_run=*/true).blob_count, 1);
  EXPECT_TRUE(Get(unused).ok());
  const Collected collected = Collect(std::chrono::seconds(0));
  EXPECT_EQ(collected.blob_count, 1);
  EXPECT_EQ(collected.blob_bytes, 6);
  EXPECT_EQ(Get(unused).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(*Get(used), "used");
  EXPECT_EQ(*Get(Sha256Hex("block")), "block");
  EXPECT_FALSE(OnS3() && ObjectIsThere(key));
  EXPECT_EQ(Put("unused", true), unused);
  EXPECT_EQ(*Get(unused), "unused");
}

TEST_P(BlobKeepingTest, CollectsMoreThanOneBatch) {
  const int count = OnS3() ? 210 : 1001;
  {
    Transaction transaction = Begin();
    for (int i = 0; i < count; ++i) PutIn(transaction, "garbage " + std::to_string(i));
    ASSERT_TRUE(transaction.Commit().ok());
  }
  EXPECT_EQ(Collect(std::chrono::seconds(0), true).blob_count, count);
  EXPECT_EQ(Collect(std::chrono::seconds(0)).blob_count, count);
  EXPECT_EQ(Run("SELECT count(*) FROM blobs").Int(0, 0), 0);
}

TEST_P(BlobKeepingTest, LeavesWhatAnUncommittedPutHolds) {
  Put("garbage so far", false);
  Transaction upload = Begin();
  const std::string sha256 = PutIn(upload, "garbage so far");
  EXPECT_EQ(Collect(std::chrono::seconds(0), false, std::chrono::hours(1)).blob_count, 0);
  ASSERT_TRUE(upload.Execute("INSERT INTO uses VALUES ($1)", Params().Digest(sha256)).ok());
  ASSERT_TRUE(upload.Commit().ok());
  EXPECT_EQ(Collect(std::chrono::seconds(0)).blob_count, 0);
  EXPECT_EQ(*Get(sha256), "garbage so far");
}

TEST_P(BlobKeepingTest, ObjectsOfFailedUploadsGoAndThoseOfOthersStay) {
  if (!OnS3()) GTEST_SKIP() << "PostgreSQL rolls its bytes back with the row";
  const StagedBlob failed = *store_->Stage(*database(), "never committed", Soon());
  const std::string orphan = ObjectKeyOf(failed.sha256, failed.object_id);
  std::this_thread::sleep_for(std::chrono::milliseconds(3100));  // the object store tells seconds
  Transaction running = Begin();
  const std::string held = PutIn(running, "still being uploaded");
  ASSERT_TRUE(store_->objects()->Put("sha256/readme", "ours", Sha256Hex("ours"), Soon()).ok());
  EXPECT_EQ(Collect(std::chrono::seconds(0), false, std::chrono::hours(24)).object_count, 0);
  EXPECT_EQ(Collect(std::chrono::seconds(0), false, std::chrono::seconds(2)).object_count, 1);
  EXPECT_FALSE(ObjectIsThere(orphan));
  EXPECT_TRUE(store_->objects()->SizeOf("sha256/readme", Soon()).ok());
  ASSERT_TRUE(running.Commit().ok());
  EXPECT_EQ(*Get(held), "still being uploaded");
}

// A staging plant beside the real one, and the real one's database restored: each knows none of the clouds.
TEST_P(BlobKeepingTest, ABucketThatIsAnothersLosesNothingAndGetsNothing) {
  if (!OnS3()) GTEST_SKIP() << "PostgreSQL's bytes are its own";
  std::vector<std::string> clouds;
  for (const char* bytes : {"one", "two", "three"}) clouds.push_back(KeyOf(Put(bytes, true)));
  const auto all_there = [&] {
    return std::all_of(clouds.begin(), clouds.end(), [&](auto& c) { return ObjectIsThere(c); });
  };
  CollectOptions everything;
  everything.grace = everything.object_grace = std::chrono::seconds(0);

  ThrowawayDatabase other;
  {
    absl::StatusOr<Transaction> transaction = other.database()->Begin(Soon());
    ASSERT_TRUE(transaction->Execute("ALTER TABLE plant_identity DISABLE TRIGGER USER").ok());
    ASSERT_TRUE(transaction->Execute("UPDATE plant_identity SET plant_id = gen_random_uuid()").ok());
    ASSERT_TRUE(transaction->Commit().ok());
  }
  const absl::Status refused = CollectGarbage(other.database(), store_->objects(), everything, Soon(60)).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("bucket: of plant "));
  EXPECT_TRUE(all_there());
  everything.dry_run = true;  // may be looked at
  EXPECT_EQ(CollectGarbage(other.database(), store_->objects(), everything, Soon(60))->object_count, 3);
  everything.dry_run = false;
  {
    const auto store = MakeObjectBlobStore(MakeS3ObjectStore(ObjectStoreConfig()));
    EXPECT_EQ(store->Stage(*other.database(), "four", Soon()).status().code(), absl::StatusCode::kFailedPrecondition);
  }

  Transaction transaction = Begin();
  const std::string ours = *BucketOwnerHere(transaction);
  const std::string before_restore = ours.substr(0, ours.rfind('/')) + "/77";
  ASSERT_TRUE(store_->objects()->Put(kOwnerKey, before_restore, Sha256Hex(before_restore), Soon()).ok());
  const std::string garbage = KeyOf(Put("garbage", false));  // the store was asked a moment ago
  const absl::Status restored = CollectGarbage(database(), store_->objects(), everything, Soon(60)).status();
  EXPECT_EQ(restored.code(), absl::StatusCode::kFailedPrecondition) << restored;
  EXPECT_THAT(std::string(restored.message()), HasSubstr("after a restore"));
  EXPECT_TRUE(ObjectIsThere(garbage));
  EXPECT_EQ(*AdoptBucket(ours, store_->objects(), Soon()), before_restore);
  ASSERT_TRUE(CollectGarbage(database(), store_->objects(), everything, Soon(60)).ok());
  EXPECT_FALSE(ObjectIsThere(garbage));
  EXPECT_TRUE(all_there());
  RecordProperty("foreign_deleted", static_cast<int>(std::count_if(clouds.begin(), clouds.end(),
                                                                   [&](auto& c) { return !ObjectIsThere(c); })));
}

// Uploads of bytes that were garbage until now, several of the same at once, while the collector runs without any grace. All
// walk in the order of digests, so that they meet. In each wave the uploaders begin at another step of the collector's first
// pass, in the last steps after it: shares of what a pass takes here and now, where a busy machine takes many times as long.
TEST_P(BlobKeepingTest, ACollectorNeverTakesWhatAPutJustStored) {
  const int waves = OnS3() ? 4 : 20;
  constexpr int kUploaders = 3, kPayloads = 40, kMostWaves = 400, kSteps = 10;
  std::int64_t collected_count = 0;
  const auto collect = [&] {
    const auto began_at = std::chrono::steady_clock::now();
    collected_count += Collect(std::chrono::seconds(0), false, std::chrono::hours(1)).blob_count;
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_at);
  };
  std::chrono::duration<double> pass = collect();
  // Until the collector met garbage, more waves.
  for (int wave = 0; wave < waves || (collected_count <= waves && wave < kMostWaves); ++wave) {
    std::map<std::string, std::string> payloads;  // by digest
    Transaction before = Begin();
    for (int i = 0; i < kPayloads; ++i) {
      const std::string bytes = "cloud " + std::to_string(wave) + "/" + std::to_string(i);
      payloads[PutIn(before, bytes)] = bytes;
    }
    ASSERT_TRUE(before.Commit().ok());
    const std::chrono::duration<double> delay = pass * (3 * wave % kSteps) / (kSteps - 2);
    std::atomic<bool> running{true}, begun{false};
    std::thread collector([&] {
      begun = true;
      for (pass = collect(); running;) collect();
    });
    std::vector<std::thread> uploaders;
    for (int uploader = 0; uploader < kUploaders; ++uploader) {
      uploaders.emplace_back([&] {
        while (!begun) std::this_thread::yield();
        std::this_thread::sleep_for(delay);
        for (const auto& [sha256, bytes] : payloads) EXPECT_EQ(Put(bytes, true), sha256);
      });
    }
    for (std::thread& uploader : uploaders) uploader.join();
    running = false;
    collector.join();
    for (const auto& [sha256, bytes] : payloads) EXPECT_EQ(Get(sha256).value_or("lost"), bytes);
  }
  RecordProperty("collected_count", static_cast<int>(collected_count));
  EXPECT_GT(collected_count, waves) << "the collector met next to no garbage, so this tested next to nothing";
}

// The same with the deletion of points: a new scan of the same blocks keeps them.
TEST_P(BlobKeepingTest, ADeletionNeverTakesWhatAPutJustStored) {
  const int rounds = OnS3() ? 15 : 60;
  for (int round = 0; round < rounds; ++round) {
    PutScan("s" + std::to_string(round), "artefact", {"cloud " + std::to_string(round), "common"}, 0);
  }
  std::atomic<std::int64_t> freed_count{0};
  std::thread deleter([&] {
    for (int round = 0; round < rounds; ++round) freed_count += Delete("s" + std::to_string(round)).freed_count;
  });
  std::thread uploader([&] {
    for (int round = 0; round < rounds; ++round) Put("cloud " + std::to_string(round), true);
  });
  deleter.join();
  uploader.join();
  Apply();  // the sweep
  for (int round = 0; round < rounds; ++round) {
    const std::string bytes = "cloud " + std::to_string(round);
    EXPECT_EQ(Get(Sha256Hex(bytes)).value_or("lost"), bytes);
  }
  EXPECT_EQ(Get(Sha256Hex("common")).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_P(BlobKeepingTest, TheCheckFindsAFlippedBitInEveryBlob) {
  std::mt19937 generator(7);
  std::set<std::string> damaged, found;
  for (int i = 0; i < 200; ++i) {
    std::string bytes(200 + generator() % 2000, '\0');
    for (char& c : bytes) c = static_cast<char>(generator());
    const std::string sha256 = Put(bytes, true);
    if (i % 2 == 0) continue;
    damaged.insert(sha256);
    const std::size_t bit = generator() % (8 * bytes.size());
    if (OnS3()) {
      bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << bit % 8));
      ASSERT_TRUE(store_->objects()->Put(KeyOf(sha256), bytes, Sha256Hex(bytes), Soon()).ok());
    } else {
      const std::string text = std::to_string(bit);
      Run("ALTER TABLE blobs DISABLE TRIGGER USER");  // as a failing disk would
      Run("UPDATE blobs SET bytes = set_bit(bytes, " + text + ", 1 - get_bit(bytes, " + text +
          ")) WHERE sha256 = '\\x" + sha256 + "'");
    }
  }
  CheckOptions options;
  options.on_damage = [&](const BlobDamage& damage) {
    EXPECT_EQ(damage.what, "digest");
    found.insert(damage.sha256);
  };
  CheckProgress last;
  options.on_progress = [&](const CheckProgress& progress) { last = progress; };
  for (int pass = 0; pass < 2; ++pass) {
    ASSERT_TRUE(CheckBlobs(database(), store_->objects(), options, {}, Soon(60)).ok());
    EXPECT_EQ(found, damaged);
    EXPECT_EQ(found.size(), 100u);
    EXPECT_EQ(last.checked_count, 200);
    EXPECT_EQ(last.damaged_count, 100);
  }
  EXPECT_EQ(Run("SELECT count(*) FROM blob_damages").Int(0, 0), 100);  // each once, though found twice
}

TEST_P(BlobKeepingTest, TheCheckFindsObjectsThatAreGoneOrOfAnotherLength) {
  if (!OnS3()) GTEST_SKIP() << "PostgreSQL's CHECK keeps bytes and length together";
  const std::string gone = Put("gone", true), longer = Put("longer", true), shorter = Put("shorter", true);
  ASSERT_TRUE(store_->objects()->Delete(KeyOf(gone), Soon()).ok());
  ASSERT_TRUE(store_->objects()->Put(KeyOf(longer), "longer!", Sha256Hex("longer!"), Soon()).ok());
  ASSERT_TRUE(store_->objects()->Put(KeyOf(shorter), "short", Sha256Hex("short"), Soon()).ok());
  std::map<std::string, std::string> found;
  CheckOptions options;
  options.on_damage = [&](const BlobDamage& damage) { found[damage.sha256] = damage.what; };
  ASSERT_TRUE(CheckBlobs(database(), store_->objects(), options, {}, Soon(60)).ok());
  EXPECT_EQ(found, (std::map<std::string, std::string>{{gone, "missing"}, {longer, "size"}, {shorter, "size"}}));
}

TEST_P(BlobKeepingTest, TheCheckGoesOnWhereItStopped) {
  for (int i = 0; i < 10; ++i) Put("blob " + std::to_string(i), true);
  CheckProgress last;
  CheckOptions options;
  options.on_progress = [&](const CheckProgress& progress) { last = progress; };
  options.keep_going = [&] { return last.checked_count < 4; };
  ASSERT_TRUE(CheckBlobs(database(), store_->objects(), options, {}, Soon(60)).ok());
  ASSERT_EQ(last.checked_count, 4);
  {
    Transaction transaction = Begin();
    ASSERT_TRUE(KeepCheckProgress(transaction, last).ok());
    ASSERT_TRUE(transaction.Commit().ok());
  }
  Transaction transaction = Begin();
  const auto state = ReadCheckState(transaction);
  ASSERT_TRUE(state.ok()) << state.status();
  options.keep_going = [] { return true; };
  ASSERT_TRUE(CheckBlobs(database(), store_->objects(), options, state->progress, Soon(60)).ok());
  EXPECT_EQ(last.checked_count, 10);
  EXPECT_EQ(last.checked_bytes, 60);
}

TEST_P(BlobKeepingTest, TheCheckKeepsItsRateAndHoldsNoConnectionWhileItWaits) {
  for (int i = 0; i < 4; ++i) Put(std::string(100'000, static_cast<char>('a' + i)), true);
  const auto single = database_.Open(1);
  std::atomic<bool> running{true};
  std::atomic<int> begun_count{0};
  std::thread other([&] {
    while (running) {
      begun_count += single->Begin(Soon(0.15)).ok();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  CheckOptions options;
  options.rate_mb_s = 0.5;
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(CheckBlobs(single.get(), store_->objects(), options, {}, Soon(60)).ok());
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  running = false;
  other.join();
  EXPECT_GE(took_s, 0.79);  // 400 kB at 0.5 MB/s
  EXPECT_LT(took_s, 5);
  EXPECT_GT(begun_count, 10);
}

TEST_P(BlobKeepingTest, DeletedPointsLeaveTheScanItsDigestAndAnEntryInTheRecord) {
  PutScan("s1", "artefact", {"first", "shared", "used"}, 0);
  PutScan("s2", "artefact", {"shared"}, 0);
  Put("used", true);
  const DeletedPoints deleted = Delete("s1");
  EXPECT_FALSE(deleted.already_deleted);
  EXPECT_EQ(deleted.freed_count, 1);
  EXPECT_EQ(deleted.freed_bytes, 5);
  EXPECT_EQ(deleted.deletion.points_bytes, 15);
  EXPECT_EQ(deleted.deletion.points_sha256, Sha256Hex("firstsharedused"));
  const absl::Status first = Get(Sha256Hex("first")).status();
  EXPECT_EQ(first.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(first.GetPayload(kReasonPayload), absl::Cord("POINTS_DELETED"));
  EXPECT_FALSE(OnS3() && ObjectIsThere(KeyOf(Sha256Hex("first"))));
  EXPECT_EQ(*Get(Sha256Hex("shared")), "shared");
  EXPECT_EQ(*Get(Sha256Hex("used")), "used");
  const absl::Status refused = PointsOf("s1");
  EXPECT_EQ(refused.GetPayload(kReasonPayload), absl::Cord("POINTS_DELETED"));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("scans/s1"));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("reason: a \"test\""));
  EXPECT_TRUE(PointsOf("s2").ok());
  Transaction transaction = Begin();
  EXPECT_TRUE(FindScan(transaction, "s1")->has_value());
  const auto made = DerivedFrom(transaction, "scans/s1");
  ASSERT_EQ(made->size(), 1u);
  EXPECT_EQ((*made)[0].entry.name, "deletions/s1");
  EXPECT_THAT((*made)[0].entry.summary_json, HasSubstr("a \\\"test\\\""));
  EXPECT_TRUE(Delete("s1").already_deleted);
  // The last scan that used them takes the shared bytes along.
  EXPECT_EQ(Delete("s2").freed_count, 1);
  EXPECT_EQ(DeleteScanPoints(database(), store_->objects(), {"none", "x", "x", "x", {}}, Soon()).status().code(),
            absl::StatusCode::kNotFound);
}

TEST_P(BlobKeepingTest, RetentionTakesWhatIsOlderThanItsKindsPolicy) {
  PutScan("old", "artefact", {"old points"}, 31);
  PutScan("young", "artefact", {"young points"}, 29);
  PutScan("other", "arm", {"other points"}, 400);
  EXPECT_EQ(Apply().scan_count, 0);  // no policy: for ever
  SetPolicy("artefact", 10);
  SetPolicy("artefact", 30);
  EXPECT_EQ(Apply(/*dry_run=*/true).scan_count, 1);
  EXPECT_TRUE(Get(Sha256Hex("old points")).ok());
  const RetentionDone done = Apply();
  EXPECT_EQ(done.scan_count, 1);
  EXPECT_EQ(done.freed_bytes, 10);
  EXPECT_EQ(Apply().scan_count, 0);
  EXPECT_THAT(std::string(PointsOf("old").message()), HasSubstr("artefact scans are kept 30 days (policy revision 2)"));
  EXPECT_TRUE(PointsOf("young").ok());
  EXPECT_TRUE(PointsOf("other").ok());
  EXPECT_EQ(*Get(Sha256Hex("young points")), "young points");
  SetPolicy("arm", 100);
  SetPolicy("arm", std::nullopt);
  EXPECT_EQ(Apply().scan_count, 0);
  EXPECT_TRUE(Get(Sha256Hex("other points")).ok());
}

TEST_P(BlobKeepingTest, BytesThatAnUploadHeldAreSweptLater) {
  PutScan("s1", "artefact", {"points"}, 0);
  {
    Transaction upload = Begin();  // fails in the end
    PutIn(upload, "points");
    EXPECT_EQ(Delete("s1").freed_count, 0);
  }
  EXPECT_TRUE(Get(Sha256Hex("points")).ok());
  EXPECT_EQ(Apply().freed_count, 1);
  EXPECT_EQ(Get(Sha256Hex("points")).status().code(), absl::StatusCode::kFailedPrecondition);
}

// Two scans of the same bytes, deleted at once: neither deletion sees the other's.
TEST_P(BlobKeepingTest, BytesOfTwoDeletionsAtOnceAreSweptLater) {
  PutScan("s1", "artefact", {"points"}, 0);
  PutScan("s2", "artefact", {"points"}, 0);
  {
    Transaction first = Begin();  // as a deletion that is not committed yet: the row is its
    ASSERT_TRUE(first.Execute("SELECT 1 FROM blobs FOR UPDATE").ok());
    EXPECT_EQ(Delete("s1").freed_count, 0);
    EXPECT_EQ(Delete("s2").freed_count, 0);
  }
  EXPECT_EQ(Apply().freed_count, 1);
  EXPECT_EQ(Get(Sha256Hex("points")).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(Run("SELECT count(*) FROM loose_blobs").Int(0, 0), 0);
}

// What runs each hour: only what lost a reference is looked at, of whatever part of the bucket.
TEST_P(BlobKeepingTest, ALooseBlobGoesAndNothingElseIsLookedAt) {
  const std::string loose = Put("loose", false), needed = Put("needed", true);
  Put("not known to be loose", false);
  Run("INSERT INTO loose_blobs (sha256) VALUES ('\\x" + loose + "'), ('\\x" + needed + "')");
  CollectOptions options;
  options.grace = options.object_grace = std::chrono::hours(1);
  options.part = 5;
  EXPECT_EQ(CollectGarbage(database(), store_->objects(), options, Soon(60))->blob_count, 0);
  options.grace = std::chrono::seconds(0);
  EXPECT_EQ(CollectGarbage(database(), store_->objects(), options, Soon(60))->blob_count, 1);
  EXPECT_EQ(Get(loose).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(*Get(needed), "needed");
  EXPECT_EQ(Apply().freed_count, 0);  // takes the hint of what is needed away
  EXPECT_EQ(Run("SELECT count(*) FROM loose_blobs").Int(0, 0), 0);
  EXPECT_EQ(Collect(std::chrono::seconds(0)).blob_count, 1);  // a person's collection looks at all
}

TEST_P(BlobKeepingTest, ThePartsTogetherAreTheWholeBucket) {
  if (!OnS3()) GTEST_SKIP() << "PostgreSQL has no bucket";
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(store_->Stage(*database(), "orphan " + std::to_string(i), Soon()).ok());
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // the object store tells seconds
  CollectOptions options;
  options.object_grace = std::chrono::seconds(0);
  std::int64_t object_count = 0, greatest = 0;
  for (int part = 0; part < kCollectParts; ++part) {
    options.part = part;
    const Collected collected = *CollectGarbage(database(), store_->objects(), options, Soon(60));
    object_count += collected.object_count;
    greatest = std::max(greatest, collected.object_count);
  }
  EXPECT_EQ(object_count, 20);
  EXPECT_LT(greatest, 10);
}

TEST_P(BlobKeepingTest, WhatIsKeptIsSummedWithoutReadingTheCatalogue) {
  PutScan("s1", "artefact", {"first", "second"}, 0);
  Put("unused", false);
  Put("first", true);  // the same again is no more
  const auto expect = [&](std::int64_t kept_count, std::int64_t kept_bytes, std::int64_t deleted_count) {
    Transaction transaction = Begin();
    const auto uses = *ReadStoreUse(transaction);
    ASSERT_EQ(uses.size(), 1u);
    EXPECT_EQ(uses[0].store, GetParam());
    EXPECT_EQ(uses[0].kept_count, kept_count);
    EXPECT_EQ(uses[0].kept_bytes, kept_bytes);
    EXPECT_EQ(uses[0].deleted_count, deleted_count);
  };
  expect(3, 17, 0);
  Delete("s1");
  Collect(std::chrono::seconds(0));
  expect(1, 5, 1);
  {
    Transaction transaction = Begin();
    ASSERT_TRUE(AddUpStoreUse(transaction).ok());
    ASSERT_TRUE(transaction.Commit().ok());
  }
  EXPECT_EQ(Run("SELECT count(*) FROM blob_use").Int(0, 0), 1);
  expect(1, 5, 1);
  PutScan("s2", "artefact", {"second"}, 0);  // comes back
  expect(2, 11, 0);
}

TEST_P(BlobKeepingTest, RetentionGoesOnWhereItWas) {
  for (int i = 0; i < 5; ++i) PutScan("s" + std::to_string(i), "artefact", {"p" + std::to_string(i)}, 100 - i);
  SetPolicy("artefact", 98);
  EXPECT_EQ(Apply().scan_count, 2);
  const std::string after = Run("SELECT after_scan_key FROM retention_progress").Text(0, 0);
  EXPECT_EQ(after, Run("SELECT record_id FROM record_names WHERE name = 'scans/s1'").Text(0, 0));
  EXPECT_EQ(Apply().scan_count, 0);
  Delete("s2");
  SetPolicy("artefact", 96);  // begins anew
  EXPECT_EQ(Apply(/*dry_run=*/true).scan_count, 1);
  EXPECT_EQ(Apply().scan_count, 1);
  EXPECT_TRUE(PointsOf("s4").ok());
}

TEST_P(BlobKeepingTest, PoliciesDeletionsAndDamagesAreAppendOnly) {
  PutScan("s1", "artefact", {"points"}, 0);
  Delete("s1");
  SetPolicy("arm", 5);
  Run("INSERT INTO blob_damages (sha256, store, what, detail) VALUES (sha256('a'), 's3', 'missing', '')");
  for (const char* change :
       {"UPDATE scan_deletions SET reason = 'x'", "DELETE FROM scan_deletions", "TRUNCATE scan_deletions",
        "UPDATE retention_policies SET keep_days = 1", "DELETE FROM retention_policies",
        "UPDATE blob_damages SET what = 'size'", "DELETE FROM blob_damages"}) {
    Transaction transaction = Begin();
    const absl::Status refused = transaction.Execute(change).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition) << change << ": " << refused;
  }
}

}  // namespace
}  // namespace sixpoint::storage
