#include "storage/requests.h"

#include <gtest/gtest.h>

#include <thread>

#include "tests/support/some_uuid.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::kSomeUuid;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;

// Records a thing of that name, under that request.
absl::Status Append(Transaction& transaction, const RecordedRequest& request, const std::string& name) {
  RecordEntry entry;
  entry.kind = "scan";
  entry.name = name;
  entry.software_version = "test";
  entry.request = KeptRequestOf(request);
  return AppendRecord(transaction, NewUuid(), entry).status();
}

absl::StatusOr<std::optional<std::string>> Named(Transaction&, const std::string& name) { return name; }

TEST(Requests, TheSameRequestGetsWhatItRecorded) {
  ThrowawayDatabase database;
  absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const RecordedRequest request{"Register", kSomeUuid, "request"};
  EXPECT_EQ(*FindKept(*transaction, request), std::nullopt);
  ASSERT_TRUE(Append(*transaction, request, "scans/s1").ok());
  ASSERT_TRUE(transaction->Commit().ok());

  absl::StatusOr<Transaction> retry = database.database()->Begin(Soon());
  EXPECT_EQ(*FindKept(*retry, request), "scans/s1");
  EXPECT_EQ(FindKept(*retry, {"Register", kSomeUuid, "another"}).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(*FindKept(*retry, {"Inspect", kSomeUuid, "another"}), std::nullopt);  // ids are a call's own
  // Of another call, what was there before.
  ASSERT_TRUE(KeepRequest(*retry, KeptRequestOf({"Inspect", kSomeUuid, "another"}), "scans/s1").ok());
  EXPECT_EQ(*FindKept(*retry, {"Inspect", kSomeUuid, "another"}), "scans/s1");
  EXPECT_EQ(KeepRequest(*retry, KeptRequestOf({"Other", kSomeUuid, ""}), "scans/s9").code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(Requests, AnEmptyIdIsNeverKept) {
  ThrowawayDatabase database;
  absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(Append(*transaction, {"Register", "", "request"}, "scans/s1").ok());
  EXPECT_EQ(*FindKept(*transaction, {"Register", "", "request"}), std::nullopt);
}

TEST(Requests, WhatIsRolledBackIsNotKept) {
  ThrowawayDatabase database;
  const RecordedRequest request{"Register", kSomeUuid, "request"};
  {
    absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
    ASSERT_TRUE(Append(*transaction, request, "scans/s1").ok());
  }
  absl::StatusOr<Transaction> retry = database.database()->Begin(Soon());
  EXPECT_EQ(*FindKept(*retry, request), std::nullopt);
}

TEST(Requests, ManyRetriesAtOnceDoTheWorkOnce) {
  ThrowawayDatabase database;
  const std::unique_ptr<Database> pool = database.Open(8);
  const RecordedRequest request{"Register", kSomeUuid, "request"};
  std::atomic<int> worked{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      const auto recorded = RecordOnce<std::string>(
          *pool, request, Soon(60), Named, [&](Transaction& transaction) -> absl::StatusOr<std::string> {
            ++worked;
            const absl::Status done = Append(transaction, request, "scans/s1");
            if (!done.ok()) return done;
            return "scans/s1";
          });
      ASSERT_TRUE(recorded.ok()) << recorded.status();
      EXPECT_EQ(*recorded, "scans/s1");
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(worked, 1);
}

TEST(Requests, WhatWasRecordedAndIsGoneIsAnErrorAndNoAnswer) {
  ThrowawayDatabase database;
  const RecordedRequest request{"Register", kSomeUuid, "request"};
  absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(Append(*transaction, request, "scans/s1").ok());
  ASSERT_TRUE(transaction->Commit().ok());
  const auto nothing = [](Transaction&, const std::string&) -> absl::StatusOr<std::optional<std::string>> {
    return std::nullopt;
  };
  const auto found = FindRecorded<std::string>(*database.database(), request, Soon(), nothing);
  EXPECT_EQ(found.status().code(), absl::StatusCode::kDataLoss) << found.status();
}

TEST(Requests, WorkThatTheDatabaseEndedIsTriedAgainFromItsStart) {
  ThrowawayDatabase database;
  const RecordedRequest request{"area.Call", kSomeUuid, "request"};
  int attempts = 0;
  const auto work = [&](Transaction& transaction) -> absl::StatusOr<std::string> {
    if (const absl::Status done = Append(transaction, request, "scans/s1"); !done.ok()) return done;
    if (++attempts < 3) return absl::AbortedError("deadlock detected");
    return "scans/s1";
  };
  EXPECT_EQ(*RecordOnce<std::string>(*database.database(), request, Soon(), Named, work), "scans/s1");
  EXPECT_EQ(attempts, 3);
  EXPECT_EQ(*RecordOnce<std::string>(*database.database(), request, Soon(), Named, work), "scans/s1");
  EXPECT_EQ(attempts, 3);  // kept
  const auto aborts = [&](Transaction&) -> absl::StatusOr<std::string> {
    ++attempts;
    return absl::AbortedError("deadlock detected");
  };
  EXPECT_TRUE(absl::IsAborted(
      RecordOnce<std::string>(*database.database(), {"area.Call", "", ""}, Soon(), Named, aborts).status()));
  EXPECT_EQ(attempts, 6);  // not for ever
}

}  // namespace
}  // namespace sixpoint::storage
