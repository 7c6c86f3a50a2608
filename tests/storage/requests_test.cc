#include "storage/requests.h"

#include <gtest/gtest.h>

#include <thread>

#include "storage/blobs.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;

constexpr char kId[] = "018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e";

TEST(Requests, TheSameRequestGetsTheSameAnswer) {
  ThrowawayDatabase database;
  absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  EXPECT_EQ(*FindAnswer(*transaction, "Register", kId, "request"), std::nullopt);
  ASSERT_TRUE(KeepAnswer(*transaction, "Register", kId, "request", std::string_view("an\0swer", 7)).ok());
  ASSERT_TRUE(transaction->Commit().ok());

  absl::StatusOr<Transaction> retry = database.database()->Begin(Soon());
  EXPECT_EQ(*FindAnswer(*retry, "Register", kId, "request"), std::string("an\0swer", 7));
  EXPECT_EQ(FindAnswer(*retry, "Register", kId, "another").status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(*FindAnswer(*retry, "Inspect", kId, "another"), std::nullopt);  // ids are a method's own
}

// As an operator's hand may leave it: the reader says so, and answers nothing.
TEST(Requests, AnAnswerThatLacksAValueIsAnErrorAndNoAnswer) {
  ThrowawayDatabase database;
  absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction->Execute("ALTER TABLE requests ALTER COLUMN response DROP NOT NULL").ok());
  const absl::StatusOr<Rows> kept =
      transaction->Execute("INSERT INTO requests (method, request_id, request_sha256) VALUES ('Register', $1, $2)",
                           Params().Text(kId).Text(Sha256Hex("request")));
  ASSERT_TRUE(kept.ok()) << kept.status();
  const auto answer = FindAnswer(*transaction, "Register", kId, "request");
  EXPECT_EQ(answer.status().code(), absl::StatusCode::kInternal) << answer.status();
}

TEST(Requests, AnEmptyIdIsNeverKept) {
  ThrowawayDatabase database;
  absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(KeepAnswer(*transaction, "Register", "", "request", "answer").ok());
  EXPECT_EQ(*FindAnswer(*transaction, "Register", "", "request"), std::nullopt);
}

TEST(Requests, ARolledBackAnswerIsNotKept) {
  ThrowawayDatabase database;
  {
    absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
    ASSERT_TRUE(KeepAnswer(*transaction, "Register", kId, "request", "answer").ok());
  }
  absl::StatusOr<Transaction> retry = database.database()->Begin(Soon());
  EXPECT_EQ(*FindAnswer(*retry, "Register", kId, "request"), std::nullopt);
}

TEST(Requests, ManyRetriesAtOnceDoTheWorkOnce) {
  ThrowawayDatabase database;
  const std::unique_ptr<Database> pool = database.Open(8);
  std::atomic<int> worked{0}, answered{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      absl::StatusOr<Transaction> transaction = pool->Begin(Soon());
      const absl::StatusOr<std::optional<std::string>> answer = FindAnswer(*transaction, "Register", kId, "request");
      ASSERT_TRUE(answer.ok()) << answer.status();
      if (answer->has_value()) {
        EXPECT_EQ(**answer, "the answer");
        ++answered;
        return;
      }
      ++worked;
      ASSERT_TRUE(KeepAnswer(*transaction, "Register", kId, "request", "the answer").ok());
      ASSERT_TRUE(transaction->Commit().ok());
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(worked, 1);
  EXPECT_EQ(answered, 7);
}

TEST(Requests, WorkThatTheDatabaseEndedIsTriedAgainFromItsStart) {
  ThrowawayDatabase database;
  int attempts = 0;
  const auto work = [&](Transaction& transaction) -> absl::StatusOr<std::string> {
    if (const auto written = transaction.Execute("CREATE TABLE written ()"); !written.ok()) return written.status();
    if (++attempts < 3) return absl::AbortedError("deadlock detected");
    return "the answer";
  };
  EXPECT_EQ(*RecordOnce(*database.database(), {"area.Call", kId, "request"}, Soon(), work), "the answer");
  EXPECT_EQ(attempts, 3);
  EXPECT_EQ(*RecordOnce(*database.database(), {"area.Call", kId, "request"}, Soon(), work), "the answer");
  EXPECT_EQ(attempts, 3);  // kept
  const auto aborts = [&](Transaction&) -> absl::StatusOr<std::string> {
    ++attempts;
    return absl::AbortedError("deadlock detected");
  };
  EXPECT_TRUE(absl::IsAborted(RecordOnce(*database.database(), {"area.Call", "", ""}, Soon(), aborts).status()));
  EXPECT_EQ(attempts, 6);  // not for ever
}

}  // namespace
}  // namespace sixpoint::storage
