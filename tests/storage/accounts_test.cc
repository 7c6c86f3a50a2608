// Accounts, the ends of sessions and failed sign-ins, as the plant's own role keeps them.
#include "storage/accounts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "storage/session_ends.h"
#include "storage/sign_in_failures.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::AsRole;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

AccountRow Jane() {
  AccountRow row;
  row.name = "users/jane";
  row.sign_in_method = "password";
  row.roles = {"engineer"};
  row.password_phc = "$argon2id$";
  return row;
}

class AccountsTest : public ::testing::Test {
 protected:
  // Of one transaction, committed.
  template <typename Work>
  auto In(const Work& work) {
    auto transaction = database_->Begin(Soon());
    EXPECT_TRUE(transaction.ok()) << transaction.status();
    auto done = work(*transaction);
    EXPECT_TRUE(transaction->Commit().ok());
    return done;
  }
  // A statement of the owner's, as if time had passed.
  void Later(const std::string& table, const std::string& interval) {
    auto transaction = throwaway_.database()->Begin(Soon());
    const std::string sql = "UPDATE " + table + " SET first_failed_at = first_failed_at - interval '" + interval +
                            "', last_failed_at = last_failed_at - interval '" + interval +
                            "', blocked_until = blocked_until - interval '" + interval + "'";
    const auto done = transaction->Execute(sql);
    EXPECT_TRUE(done.ok()) << done.status();
    EXPECT_TRUE(transaction->Commit().ok());
  }
  std::optional<Instant> Begin(const std::vector<FailureCounter>& counters) {
    const auto waits = In([&](Transaction& t) { return BeginSignIn(t, counters); });
    EXPECT_TRUE(waits.ok()) << waits.status();
    return waits.value_or(std::nullopt);
  }

  sixpoint::testing::ThrowawayDatabase throwaway_;
  std::unique_ptr<Database> database_ = Database::Open(AsRole(throwaway_.conninfo(), "plant"), 4);
};

TEST_F(AccountsTest, AreKeptAsTheyStandAndWhatWasDoneToThemToo) {
  EXPECT_EQ(*In([](Transaction& t) { return InsertAccount(t, Jane()); }), true);
  EXPECT_EQ(*In([](Transaction& t) { return InsertAccount(t, Jane()); }), false);
  AccountRow row = **In([](Transaction& t) { return LockAccount(t, "users/jane"); });
  EXPECT_THAT(row.roles, ElementsAre("engineer"));
  EXPECT_FALSE(row.disabled);
  row.roles = {"quality", "admin"};
  row.disabled = true;
  EXPECT_TRUE(In([&](Transaction& t) { return UpdateAccount(t, row); }).ok());
  EXPECT_TRUE(In([&](Transaction& t) { return AppendAccountEvent(t, row, AccountEvent::kRolesSet, "users/it"); }).ok());
  const AccountRow after = **In([](Transaction& t) { return FindAccount(t, "users/jane"); });
  EXPECT_EQ(after.roles, row.roles);
  EXPECT_TRUE(after.disabled);
  EXPECT_GE(after.changed_at, row.changed_at);
  EXPECT_FALSE(In([](Transaction& t) { return FindAccount(t, "users/nobody"); })->has_value());
  // Events stay.
  auto owner = throwaway_.database()->Begin(Soon());
  EXPECT_THAT(std::string(owner->Execute("DELETE FROM account_events").status().message()), HasSubstr("append-only"));
}

TEST_F(AccountsTest, OneSubjectOfAProviderIsOneAccount) {
  AccountRow row;
  row.name = "users/joe";
  row.sign_in_method = "oidc";
  row.roles = {"quality"};
  row.issuer = "https://id.plant.example";
  row.issuer_subject = "f3a1";
  EXPECT_EQ(*In([&](Transaction& t) { return InsertAccount(t, row); }), true);
  row.name = "users/joseph";
  EXPECT_EQ(*In([&](Transaction& t) { return InsertAccount(t, row); }), false);
  const auto found = In([&](Transaction& t) { return LockAccountOfSubject(t, "https://id.plant.example", "f3a1"); });
  EXPECT_EQ((*found)->name, "users/joe");
  EXPECT_EQ((*found)->password_phc, "");
  EXPECT_FALSE(
      In([&](Transaction& t) { return LockAccountOfSubject(t, "https://other.example", "f3a1"); })->has_value());
}

// What no service should ask is refused by the schema, too.
TEST_F(AccountsTest, NothingElseIsAnAccount) {
  const auto refused = [&](const AccountRow& row) {
    auto transaction = database_->Begin(Soon());
    return InsertAccount(*transaction, row).status();
  };
  for (const char* name : {"jane", "users/", "users/.jane", "users/a b", "machines/m1", "users/../x"}) {
    AccountRow row = Jane();
    row.name = name;
    EXPECT_EQ(refused(row).code(), absl::StatusCode::kFailedPrecondition) << name;
  }
  for (const std::vector<std::string>& roles :
       std::vector<std::vector<std::string>>{{}, {"service"}, {"gateway"}, {"engineer", "boss"}}) {
    AccountRow row = Jane();
    row.roles = roles;
    EXPECT_EQ(refused(row).code(), absl::StatusCode::kFailedPrecondition);
  }
  AccountRow both = Jane();
  both.issuer = "https://id.plant.example";
  both.issuer_subject = "x";
  EXPECT_EQ(refused(both).code(), absl::StatusCode::kFailedPrecondition);
  AccountRow neither = Jane();
  neither.password_phc.clear();
  EXPECT_EQ(refused(neither).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(AccountsTest, ListsByName) {
  for (const char* name : {"users/c", "users/a", "users/B"}) {
    AccountRow row = Jane();
    row.name = name;
    EXPECT_TRUE(In([&](Transaction& t) { return InsertAccount(t, row); }).ok());
  }
  const auto first = In([](Transaction& t) { return ListAccounts(t, "users/", 2); });
  ASSERT_EQ(first->size(), 2u);
  EXPECT_EQ((*first)[0].name, "users/B");
  EXPECT_EQ((*first)[1].name, "users/a");
  const auto second = In([](Transaction& t) { return ListAccounts(t, "users/a", 2); });
  ASSERT_EQ(second->size(), 1u);
  EXPECT_EQ((*second)[0].name, "users/c");
}

TEST_F(AccountsTest, EveryServiceReadsTheEndsOfSessions) {
  const Instant before = *In([](Transaction& t) { return DatabaseNow(t); });
  ASSERT_TRUE(In([](Transaction& t) { return EndSessions(t, "users/jane"); }).ok());
  ASSERT_TRUE(In([](Transaction& t) { return EndSessions(t, "users/jane"); }).ok());
  for (const char* area : {"plant", "ingest", "calibration", "registration", "correction", "inspection"}) {
    const auto database = Database::Open(AsRole(throwaway_.conninfo(), area), 1);
    auto transaction = database->Begin(Soon());
    const auto ends = RecentSessionEnds(*transaction);
    ASSERT_TRUE(ends.ok()) << area << ": " << ends.status();
    ASSERT_EQ(ends->size(), 1u);
    EXPECT_GT(ends->at("users/jane"), before);
  }
  EXPECT_TRUE(In([](Transaction& t) { return SessionsEndedBefore(t, "users/jane"); })->has_value());
  EXPECT_FALSE(In([](Transaction& t) { return SessionsEndedBefore(t, "users/joe"); })->has_value());
  // What is so old that no token can be older is not read again and again.
  auto owner = throwaway_.database()->Begin(Soon());
  ASSERT_TRUE(owner->Execute("UPDATE session_ends SET ended_before = ended_before - interval '1 hour'").ok());
  ASSERT_TRUE(owner->Commit().ok());
  EXPECT_TRUE(In(RecentSessionEnds)->empty());
}

TEST_F(AccountsTest, AfterFiveFailuresTheWaitGrows) {
  const std::vector<FailureCounter> jane = {{"users/jane", 5}};
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(Begin(jane)) << i;
  double before_s = 0;
  for (int i = 0; i < 8; ++i) {
    const Instant now = *In([](Transaction& t) { return DatabaseNow(t); });
    const std::optional<Instant> until = Begin(jane);
    ASSERT_TRUE(until) << i;
    const double wait_s = std::chrono::duration<double>(*until - now).count();
    std::printf("after %d failures: %.0f s\n", 5 + i, wait_s);
    EXPECT_GT(wait_s, std::min(before_s * 1.5, 880.0));
    EXPECT_LE(wait_s, 901);
    before_s = wait_s;
    EXPECT_TRUE(Begin(jane));  // who does not wait waits no longer for it
    Later("sign_in_failures", std::to_string(static_cast<int>(wait_s) + 1) + " seconds");
    EXPECT_FALSE(Begin(jane)) << i;  // and fails once more
  }
  EXPECT_GT(before_s, 800);
  EXPECT_FALSE(Begin({{"users/joe", 5}}));
  // Quiet for a quarter of an hour after the last wait: as new.
  Later("sign_in_failures", "31 minutes");
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(Begin(jane)) << i;
  EXPECT_TRUE(Begin(jane));
}

TEST_F(AccountsTest, ASignInThatWentWellForgetsTheAccountsFailuresAlone) {
  const FailureCounter address{"address 1", 6};
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(Begin({{"users/jane", 5}, address}));
  ASSERT_TRUE(In([&](Transaction& t) { return SignInWentWell(t, "users/jane", address); }).ok());
  // Three of the address are left: three more are free.
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(Begin({{"users/jane", 5}, address})) << i;
  EXPECT_TRUE(Begin({{"users/joe", 5}, address}));
  EXPECT_FALSE(Begin({{"users/jane", 5}, {"address 2", 6}}));
}

// Many at once get no more tries than one after the other.
TEST_F(AccountsTest, ManyAtOnceCountAsMany) {
  std::atomic<int> let_in{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      for (int j = 0; j < 5; ++j)
        // Addresses that come before and after the account, so that each takes locks in another order if they are not sorted.
        if (!Begin({{i % 2 == 0 ? "zzz" : "aaa", 1000}, {"users/jane", 5}})) ++let_in;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(let_in, 5);
}

TEST_F(AccountsTest, WhatIsLongOverIsForgotten) {
  for (int i = 0; i < 50; ++i) Begin({{"users/u" + std::to_string(i), 5}});
  Later("sign_in_failures", "2 hours");
  Begin({{"users/last", 5}});
  auto owner = throwaway_.database()->Begin(Soon());
  EXPECT_EQ(owner->Execute("SELECT count(*) FROM sign_in_failures")->Int(0, 0), 1);
}

}  // namespace
}  // namespace sixpoint::storage
