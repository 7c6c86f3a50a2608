#include "storage/database.h"

#include <absl/strings/cord.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <thread>

#include "storage/reasons.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

class DatabaseTest : public ::testing::Test {
 protected:
  void SetUp() override {
    Do("CREATE TABLE parents (id integer PRIMARY KEY, depth_mm double precision "
       "CONSTRAINT parents_depth_positive CHECK (depth_mm > 0))");
    Do("CREATE TABLE children (parent_id integer NOT NULL REFERENCES parents (id))");
  }
  // One committed statement.
  void Do(const std::string& sql) {
    const absl::Status done = Try(sql);
    ASSERT_TRUE(done.ok()) << done;
  }
  absl::Status Try(const std::string& sql) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    if (!transaction.ok()) return transaction.status();
    const absl::StatusOr<Rows> rows = transaction->Execute(sql);
    if (!rows.ok()) return rows.status();
    return transaction->Commit();
  }
  std::int64_t CountParents() {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    EXPECT_TRUE(transaction.ok()) << transaction.status();
    return transaction->Execute("SELECT count(*) FROM parents")->Int(0, 0);
  }
  ThrowawayDatabase database_{ThrowawayDatabase::Schema::kEmpty};
};

TEST_F(DatabaseTest, WhatIsNotCommittedIsRolledBack) {
  {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    ASSERT_TRUE(transaction.ok());
    const absl::StatusOr<Rows> rows = transaction->Execute("INSERT INTO parents VALUES (1, 2.5), (2, 3.5)");
    ASSERT_TRUE(rows.ok());
    EXPECT_EQ(rows->affected(), 2);
  }
  EXPECT_EQ(CountParents(), 0);
  Do("INSERT INTO parents VALUES (1, 2.5)");
  EXPECT_EQ(CountParents(), 1);
}

TEST_F(DatabaseTest, ViolationsSayWhatTheyAre) {
  Do("INSERT INTO parents VALUES (1, 2.5)");
  const absl::Status twice = Try("INSERT INTO parents VALUES (1, 2.5)");
  EXPECT_EQ(twice.code(), absl::StatusCode::kAlreadyExists) << twice;
  const absl::Status orphan = Try("INSERT INTO children VALUES (7)");
  EXPECT_EQ(orphan.code(), absl::StatusCode::kFailedPrecondition) << orphan;
  const absl::Status negative = Try("INSERT INTO parents VALUES (2, -1)");
  EXPECT_EQ(negative.code(), absl::StatusCode::kFailedPrecondition) << negative;
  EXPECT_THAT(std::string(negative.message()), ::testing::HasSubstr("parents_depth_positive"));
  EXPECT_EQ(Try("SELECT 1/0").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Try("SELEC 1").code(), absl::StatusCode::kInternal);
}

TEST_F(DatabaseTest, OneOfTwoDeadlockedTransactionsIsAborted) {
  Do("INSERT INTO parents VALUES (1, 1), (2, 1)");
  absl::StatusOr<Transaction> first = database_.database()->Begin(Soon());
  absl::StatusOr<Transaction> second = database_.database()->Begin(Soon());
  ASSERT_TRUE(first->Execute("UPDATE parents SET depth_mm = 2 WHERE id = 1").ok());
  ASSERT_TRUE(second->Execute("UPDATE parents SET depth_mm = 2 WHERE id = 2").ok());
  absl::Status crossed;
  std::thread other([&] { crossed = first->Execute("UPDATE parents SET depth_mm = 3 WHERE id = 2").status(); });
  const absl::Status back = second->Execute("UPDATE parents SET depth_mm = 3 WHERE id = 1").status();
  { const Transaction ended = *std::move(second); }  // frees the first one where it was the second that failed
  other.join();
  EXPECT_NE(crossed.ok(), back.ok());
  EXPECT_EQ((crossed.ok() ? back : crossed).code(), absl::StatusCode::kAborted);
}

// Each reads what the other writes: one of them has to be begun again, and then goes through.
TEST_F(DatabaseTest, ATransactionThatCannotBeSerialisedIsAbortedAndMayBeBegunAgain) {
  Do("INSERT INTO parents VALUES (1, 1), (2, 1)");
  const auto write = [](Transaction& transaction, const char* id) {
    for (const std::string sql : {"SET TRANSACTION ISOLATION LEVEL SERIALIZABLE", "SELECT sum(depth_mm) FROM parents"})
      if (const absl::Status status = transaction.Execute(sql).status(); !status.ok()) return status;
    return transaction.Execute("UPDATE parents SET depth_mm = 2 WHERE id = " + std::string(id)).status();
  };
  absl::StatusOr<Transaction> first = database_.database()->Begin(Soon());
  absl::StatusOr<Transaction> second = database_.database()->Begin(Soon());
  ASSERT_TRUE(write(*first, "1").ok());
  ASSERT_TRUE(write(*second, "2").ok());
  ASSERT_TRUE(first->Commit().ok());
  const absl::Status refused = second->Commit();
  EXPECT_EQ(refused.code(), absl::StatusCode::kAborted) << refused;
  EXPECT_EQ(refused.GetPayload(kReasonPayload), absl::Cord(kTransactionConflict));
  absl::StatusOr<Transaction> again = database_.database()->Begin(Soon());
  ASSERT_TRUE(write(*again, "2").ok());
  EXPECT_TRUE(again->Commit().ok());
}

TEST_F(DatabaseTest, CommitAfterAFailedStatementIsNotSuccess) {
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  ASSERT_TRUE(transaction->Execute("INSERT INTO parents VALUES (5, 1)").ok());
  ASSERT_FALSE(transaction->Execute("INSERT INTO parents VALUES (5, 1)").ok());
  EXPECT_EQ(transaction->Commit().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(CountParents(), 0);
}

TEST_F(DatabaseTest, ASlowStatementEndsAtTheDeadlineAndTheConnectionLivesOn) {
  const std::unique_ptr<Database> database = database_.Open(1);
  const auto begin = steady_clock::now();
  {
    absl::StatusOr<Transaction> transaction = database->Begin(Soon(0.3));
    ASSERT_TRUE(transaction.ok());
    const absl::Status slow = transaction->Execute("SELECT pg_sleep(30)").status();
    EXPECT_EQ(slow.code(), absl::StatusCode::kDeadlineExceeded) << slow;
    EXPECT_EQ(transaction->Execute("SELECT 1").status().code(), absl::StatusCode::kDeadlineExceeded);
    EXPECT_EQ(transaction->Commit().code(), absl::StatusCode::kDeadlineExceeded);
  }
  EXPECT_LT(steady_clock::now() - begin, milliseconds(1300));
  absl::StatusOr<Transaction> next = database->Begin(Soon());
  ASSERT_TRUE(next.ok()) << next.status();
  EXPECT_EQ(next->Execute("SELECT 42")->Int(0, 0), 42);
}

// A service that froze while it held a lock: the others go on after eight seconds, and it hears that its work is not kept.
TEST_F(DatabaseTest, AHolderThatSaysNothingLosesItsLock) {
  absl::StatusOr<Transaction> holder = database_.database()->Begin(Soon(30));
  ASSERT_TRUE(holder->Execute("SELECT pg_advisory_xact_lock(7)").ok());
  const auto begin = steady_clock::now();
  absl::StatusOr<Transaction> waiting = database_.database()->Begin(Soon(30));
  EXPECT_TRUE(waiting->Execute("SELECT pg_advisory_xact_lock(7)").ok());
  // 8 s by the server's clock; a busy machine notices later.
  EXPECT_LT(steady_clock::now() - begin, std::chrono::seconds(15));
  EXPECT_EQ(holder->Execute("SELECT 1").status().code(), absl::StatusCode::kUnavailable);
}

// What PostgreSQL does with every statement under way when its clock is set forward.
TEST_F(DatabaseTest, AServerThatGivesUpBeforeTheDeadlineIsAskedAgain) {
  auto transaction = database_.database()->Begin(Soon(60));
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  ASSERT_TRUE(transaction->Execute("SET LOCAL statement_timeout = 20").ok());
  const absl::Status early = transaction->Execute("SELECT pg_sleep(30)").status();
  EXPECT_TRUE(absl::IsUnavailable(early)) << early;
  EXPECT_NE(early.message().find("its clock was set"), std::string::npos) << early;
}

TEST_F(DatabaseTest, ADeadlineThatIsOverIsRefusedAtOnce) {
  EXPECT_EQ(database_.database()->Begin(Soon(-1)).status().code(), absl::StatusCode::kDeadlineExceeded);
}

TEST_F(DatabaseTest, ADeadlineOfNeverWorks) {
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Deadline::max());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  EXPECT_EQ(transaction->Execute("SELECT 1")->Int(0, 0), 1);
}

TEST_F(DatabaseTest, AFullPoolWaitsThenSaysResourceExhausted) {
  const std::unique_ptr<Database> database = database_.Open(2);
  absl::StatusOr<Transaction> first = database->Begin(Soon());
  absl::StatusOr<Transaction> second = database->Begin(Soon());
  ASSERT_TRUE(first.ok() && second.ok());
  const auto begin = steady_clock::now();
  EXPECT_EQ(database->Begin(Soon(0.2)).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_GE(steady_clock::now() - begin, milliseconds(190));
  std::thread frees([&] {
    std::this_thread::sleep_for(milliseconds(100));
    ASSERT_TRUE(first->Commit().ok());
  });
  const absl::StatusOr<Transaction> third = database->Begin(Soon());
  frees.join();
  EXPECT_TRUE(third.ok()) << third.status();
}

TEST_F(DatabaseTest, ManyThreadsShareAFewConnections) {
  Do("INSERT INTO parents VALUES (1, 1)");
  const std::unique_ptr<Database> database = database_.Open(3);
  std::atomic<int> failures{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 12; ++i) {
    threads.emplace_back([&] {
      for (int j = 0; j < 20; ++j) {
        absl::StatusOr<Transaction> transaction = database->Begin(Soon());
        const bool done = transaction.ok() &&
                          transaction->Execute("UPDATE parents SET depth_mm = depth_mm + 1 WHERE id = 1").ok() &&
                          transaction->Commit().ok();
        if (!done) ++failures;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failures, 0);
  absl::StatusOr<Transaction> transaction = database->Begin(Soon());
  EXPECT_EQ(transaction->Execute("SELECT depth_mm FROM parents")->Real(0, 0), 241);
}

TEST_F(DatabaseTest, ASessionThatIsTerminatedIsReplaced) {
  const std::unique_ptr<Database> database = database_.Open(1);
  {
    absl::StatusOr<Transaction> transaction = database->Begin(Soon());
    const std::int64_t pid = transaction->Execute("SELECT pg_backend_pid()")->Int(0, 0);
    absl::StatusOr<Transaction> other = database_.database()->Begin(Soon());
    ASSERT_TRUE(other->Execute("SELECT pg_terminate_backend($1::integer)", Params().Int(pid)).ok());
    absl::Status gone;
    for (int i = 0; i < 50 && gone.ok(); ++i) gone = transaction->Execute("SELECT pg_sleep(0.02)").status();
    EXPECT_EQ(gone.code(), absl::StatusCode::kUnavailable) << gone;
    EXPECT_FALSE(transaction->Commit().ok());
  }
  const absl::StatusOr<Transaction> next = database->Begin(Soon());
  EXPECT_TRUE(next.ok()) << next.status();
}

TEST_F(DatabaseTest, AFrozenServerDoesNotHoldTheCallerPastItsDeadline) {
  const std::unique_ptr<Database> database = database_.Open(1);
  pid_t frozen = 0;
  const auto begin = steady_clock::now();
  {
    absl::StatusOr<Transaction> transaction = database->Begin(Soon(0.5));
    frozen = static_cast<pid_t>(transaction->Execute("SELECT pg_backend_pid()")->Int(0, 0));
    ASSERT_EQ(kill(frozen, SIGSTOP), 0);
    const absl::Status late = transaction->Execute("SELECT 1").status();
    EXPECT_EQ(late.code(), absl::StatusCode::kDeadlineExceeded) << late;
  }
  EXPECT_LT(steady_clock::now() - begin, milliseconds(1500));  // the deadline + 1 s
  absl::StatusOr<Transaction> next = database->Begin(Soon());
  ASSERT_TRUE(next.ok()) << next.status();
  EXPECT_NE(next->Execute("SELECT pg_backend_pid()")->Int(0, 0), frozen);
  kill(frozen, SIGCONT);
}

// Of whatever it answers, for work may take longer than a silence that somebody is told of.
TEST_F(DatabaseTest, WhenItLastAnsweredIsKnown) {
  const std::unique_ptr<Database> database = database_.Open(1);
  auto last = steady_clock::now();
  const auto heard = [&] {
    const auto answered = database->use().answered;
    const bool is_new = answered && *answered > last;
    last = steady_clock::now();
    return is_new;
  };
  EXPECT_FALSE(heard());
  {
    absl::StatusOr<Transaction> transaction = database->Begin(Soon());
    ASSERT_TRUE(transaction.ok()) << transaction.status();
    EXPECT_TRUE(heard());
    EXPECT_FALSE(heard());
    ASSERT_TRUE(transaction->Execute("SELECT 1").ok());
    EXPECT_TRUE(heard());
    ASSERT_FALSE(transaction->Execute("SELECT 1 / 0").ok());
    EXPECT_TRUE(heard());
    EXPECT_FALSE(transaction->Commit().ok());
    EXPECT_TRUE(heard());
  }
  absl::StatusOr<Transaction> next = database->Begin(Soon(2));
  ASSERT_TRUE(next.ok()) << next.status();
  const auto frozen = static_cast<pid_t>(next->Execute("SELECT pg_backend_pid()")->Int(0, 0));
  ASSERT_EQ(kill(frozen, SIGSTOP), 0);
  EXPECT_TRUE(heard());
  EXPECT_FALSE(next->Execute("SELECT 1").ok());
  EXPECT_FALSE(heard());
  kill(frozen, SIGCONT);
}

TEST_F(DatabaseTest, AServerThatCrashesIsUnavailableAndComesBackByItself) {
  Do("INSERT INTO parents VALUES (1, 1)");
  absl::StatusOr<Transaction> open = database_.database()->Begin(Soon());
  ASSERT_TRUE(open->Execute("INSERT INTO parents VALUES (2, 1)").ok());
  ThrowawayDatabase::KillServer();
  EXPECT_EQ(open->Execute("SELECT 1").status().code(), absl::StatusCode::kUnavailable);
  const absl::Status lost = open->Commit();
  EXPECT_EQ(lost.code(), absl::StatusCode::kUnavailable) << lost;
  { const Transaction ended = *std::move(open); }
  const absl::Status down = database_.database()->Begin(Soon()).status();
  EXPECT_EQ(down.code(), absl::StatusCode::kUnavailable) << down;
  ThrowawayDatabase::StartServer();
  EXPECT_EQ(CountParents(), 1);  // what was committed, and nothing else
}

TEST_F(DatabaseTest, ACrashBetweenCallsIsNotSeenByTheNextOne) {
  absl::StatusOr<Transaction> first = database_.database()->Begin(Soon());
  absl::StatusOr<Transaction> second = database_.database()->Begin(Soon());
  ASSERT_TRUE(first->Commit().ok() && second->Commit().ok());  // two idle connections
  ThrowawayDatabase::KillServer();
  ThrowawayDatabase::StartServer();
  EXPECT_EQ(CountParents(), 0);
}

// A migration while services run: what a session has prepared no longer gives what it gave.
TEST_F(DatabaseTest, AStatementWhoseTableChangedIsPreparedAgain) {
  Do("INSERT INTO parents VALUES (1, 2.5)");
  const std::unique_ptr<Database> database = database_.Open(1);
  const auto all = [&]() -> absl::StatusOr<Rows> {
    absl::StatusOr<Transaction> transaction = database->Begin(Soon());
    if (!transaction.ok()) return transaction.status();
    return transaction->Execute("SELECT * FROM parents");
  };
  EXPECT_EQ(all()->count(), 1);
  EXPECT_EQ(all()->count(), 1);
  Do("ALTER TABLE parents ADD COLUMN width_mm double precision");
  const auto wider = all();
  ASSERT_TRUE(wider.ok()) << wider.status();
  EXPECT_TRUE(wider->IsNull(0, 2));
  // What somebody between here and the server discarded is no more, too: within a transaction it is begun again by who began it.
  {
    absl::StatusOr<Transaction> transaction = database->Begin(Soon());
    ASSERT_TRUE(transaction->Execute("SELECT * FROM parents").ok());
    ASSERT_TRUE(transaction->Execute("DEALLOCATE ALL").ok());
    EXPECT_EQ(transaction->Execute("SELECT * FROM parents").status().code(), absl::StatusCode::kUnavailable);
  }
  EXPECT_TRUE(all().ok());
}

// More texts than are kept prepared, and long ones.
TEST_F(DatabaseTest, ManyStatementsAreRunAsWell) {
  const std::unique_ptr<Database> database = database_.Open(1);
  absl::StatusOr<Transaction> transaction = database->Begin(Soon(60));
  for (int round = 0; round < 2; ++round)
    for (int i = 0; i < 300; ++i)
      ASSERT_EQ(transaction->Execute("SELECT " + std::to_string(i) + " + $1::integer", Params().Int(1))->Int(0, 0),
                i + 1);
  EXPECT_EQ(transaction->Execute("SELECT 7 /*" + std::string(20000, 'x') + "*/")->Int(0, 0), 7);
  const auto prepared = transaction->Execute("SELECT count(*) FROM pg_prepared_statements");
  EXPECT_EQ(prepared->Int(0, 0), 256);
}

// The server hears of the roll-back before anybody else has the connection, and of nothing where nothing was said.
TEST_F(DatabaseTest, WhatWasAbandonedIsNotSeenByWhoComesNext) {
  const std::unique_ptr<Database> database = database_.Open(1);
  std::int64_t pid = 0;
  {
    absl::StatusOr<Transaction> transaction = database->Begin(Soon());
    pid = transaction->Execute("SELECT pg_backend_pid()")->Int(0, 0);
    ASSERT_TRUE(transaction->Execute("INSERT INTO parents VALUES (7, 1)").ok());
  }
  { const absl::StatusOr<Transaction> silent = database->Begin(Soon()); }
  absl::StatusOr<Transaction> next = database->Begin(Soon());
  EXPECT_EQ(next->Execute("SELECT count(*) FROM parents")->Int(0, 0), 0);
  EXPECT_EQ(next->Execute("SELECT pg_backend_pid()")->Int(0, 0), pid);
  EXPECT_TRUE(next->Commit().ok());
}

TEST_F(DatabaseTest, SchemaVersionIsZeroBeforeAnyMigration) {
  const absl::StatusOr<int> version = database_.database()->SchemaVersion(Soon());
  ASSERT_TRUE(version.ok()) << version.status();
  EXPECT_EQ(*version, 0);
}

}  // namespace
}  // namespace sixpoint::storage
