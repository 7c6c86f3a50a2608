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

FailureCounters Of(const std::string& account) { return {FailureCounter{account, 5}, std::nullopt}; }
FailureCounters Of(const std::string& account, const std::string& address, int free_of_address = 6) {
  return {FailureCounter{account, 5}, FailureCounter{address, free_of_address}};
}

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
  // As if time had passed.
  void Later(const std::string& table, const std::string& interval) {
    Do("UPDATE " + table + " SET first_failed_at = first_failed_at - interval '" + interval +
       "', last_failed_at = last_failed_at - interval '" + interval + "', blocked_until = blocked_until - interval '" +
       interval + "'");
  }
  SignInStart Start(const FailureCounters& counters) {
    const auto start = In([&](Transaction& t) { return BeginSignIn(t, counters); });
    EXPECT_TRUE(start.ok()) << start.status();
    const SignInStart started = start.value_or(SignInStart());
    EXPECT_NE(started.waits_until.has_value(), started.counted_at.has_value());
    return started;
  }
  std::optional<Instant> Begin(const FailureCounters& counters) { return Start(counters).waits_until; }
  // As the owner, who may do anything.
  void Do(const std::string& sql) {
    auto transaction = throwaway_.database()->Begin(Soon());
    const auto done = transaction->Execute(sql);
    EXPECT_TRUE(done.ok()) << done.status();
    EXPECT_TRUE(transaction->Commit().ok());
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
  const auto first = In([](Transaction& t) { return ListAccounts(t, {}, "users/", 2); });
  ASSERT_EQ(first->size(), 2u);
  EXPECT_EQ((*first)[0].name, "users/B");
  EXPECT_EQ((*first)[1].name, "users/a");
  const auto second = In([](Transaction& t) { return ListAccounts(t, {}, "users/a", 2); });
  ASSERT_EQ(second->size(), 1u);
  EXPECT_EQ((*second)[0].name, "users/c");
}

TEST_F(AccountsTest, EveryServiceReadsTheEndsOfSessions) {
  const Instant before = *In([](Transaction& t) { return NowOf(t); });
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
  const FailureCounters jane = Of("users/jane");
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(Begin(jane)) << i;
  double before_s = 0;
  for (int i = 0; i < 8; ++i) {
    const Instant now = *In([](Transaction& t) { return NowOf(t); });
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
  EXPECT_FALSE(Begin(Of("users/joe")));
  // Quiet for a quarter of an hour after the last wait: as new.
  Later("sign_in_failures", "31 minutes");
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(Begin(jane)) << i;
  EXPECT_TRUE(Begin(jane));
}

TEST_F(AccountsTest, ASignInThatWentWellForgetsTheAccountsFailuresAlone) {
  const FailureCounters jane = Of("users/jane", "1");
  SignInStart last;
  for (int i = 0; i < 4; ++i) last = Start(jane);
  ASSERT_TRUE(In([&](Transaction& t) { return SignInWentWell(t, jane, *last.counted_at); }).ok());
  // Three of the address are left: three more are free.
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(Begin(jane)) << i;
  EXPECT_TRUE(Begin(Of("users/joe", "1")));
  EXPECT_FALSE(Begin(Of("users/jane", "2")));
}

// What came to nothing by no fault of who tried leaves nothing, also where it would have made him wait.
TEST_F(AccountsTest, WhatWasNotJudgedIsGivenBack) {
  const FailureCounters jane = Of("users/jane", "1");
  const auto give_back = [&](const SignInStart& start) {
    ASSERT_TRUE(start.counted_at);
    ASSERT_TRUE(In([&](Transaction& t) { return GiveSignInBack(t, jane, *start.counted_at); }).ok());
  };
  for (int i = 0; i < 12; ++i) give_back(Start(jane));
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(Begin(jane)) << i;
  EXPECT_TRUE(Begin(jane));
  // After its wait, too: the sixth, seventh, ... are not judged, and none has to wait for them.
  Later("sign_in_failures", "31 seconds");
  for (int i = 0; i < 4; ++i) give_back(Start(jane));
  const SignInStart slow = Start(jane);
  ASSERT_TRUE(slow.counted_at);
  EXPECT_TRUE(Begin(jane));
  // Of a counter that began anew meanwhile nothing is taken: what failed since has failed.
  ASSERT_TRUE(In([&](Transaction& t) { return SignInWentWell(t, Of("users/jane"), *slow.counted_at); }).ok());
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(Begin(Of("users/jane"))) << i;
  give_back(slow);
  EXPECT_TRUE(Begin(Of("users/jane")));
}

// One that takes so long that another failed since gives back itself, and not the other's wait.
TEST_F(AccountsTest, WhatIsGivenBackLateLeavesTheWaitOfWhoFailedSince) {
  const FailureCounters jane = Of("users/jane");
  for (int i = 0; i < 6; ++i) {
    Later("sign_in_failures", "61 seconds");
    EXPECT_FALSE(Begin(jane)) << i;
  }
  Later("sign_in_failures", "61 seconds");
  const SignInStart slow = Start(jane);
  ASSERT_TRUE(slow.counted_at);
  Do("UPDATE sign_in_failures SET blocked_until = clock_timestamp()");  // its wait is over, and it still runs
  EXPECT_FALSE(Begin(jane));
  ASSERT_TRUE(In([&](Transaction& t) { return GiveSignInBack(t, jane, *slow.counted_at); }).ok());
  EXPECT_TRUE(Begin(jane));
}

// Whatever is typed as an account counts for no address, and the other way round.
TEST_F(AccountsTest, NoAccountIsAnAddress) {
  for (const std::string typed : {"0a000001", "address 0a000001", "account 0a000001", ""}) {
    for (int i = 0; i < 5; ++i) EXPECT_FALSE(Begin(Of(typed))) << typed << i;
    EXPECT_TRUE(Begin(Of(typed))) << typed;
  }
  EXPECT_FALSE(Begin({std::nullopt, FailureCounter{"0a000001", 1}}));
  EXPECT_TRUE(Begin({std::nullopt, FailureCounter{"0a000001", 1}}));
  EXPECT_FALSE(Begin(Of("address 1", "2")));
  EXPECT_FALSE(Begin({std::nullopt, FailureCounter{"1", 1}}));
}

// Many at once get no more tries than one after the other.
TEST_F(AccountsTest, ManyAtOnceCountAsMany) {
  std::atomic<int> let_in{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      for (int j = 0; j < 5; ++j)
        if (!Begin(Of("users/jane", std::to_string(i % 2), 1000))) ++let_in;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(let_in, 5);
}

TEST_F(AccountsTest, WhatIsLongOverIsForgotten) {
  for (int i = 0; i < 50; ++i) Begin(Of("users/u" + std::to_string(i)));
  Later("sign_in_failures", "2 hours");
  Begin(Of("users/last"));
  // One that somebody tries on is left to him, and waited for by nobody.
  auto holder = database_->Begin(Soon());
  ASSERT_TRUE(BeginSignIn(*holder, Of("users/u7")).ok());
  EXPECT_TRUE(In(ForgetSignInFailures).ok());
  ASSERT_TRUE(holder->Commit().ok());
  auto owner = throwaway_.database()->Begin(Soon());
  EXPECT_EQ(owner->Execute("SELECT count(*) FROM sign_in_failures")->Int(0, 0), 2);
}

// Who begins holds his own counters alone, so that no two wait for each other.
TEST_F(AccountsTest, WhoBeginsHoldsNobodyElsesCounter) {
  Begin(Of("users/joe", "2"));
  Later("sign_in_failures", "2 hours");
  auto holder = database_->Begin(Soon());
  ASSERT_TRUE(BeginSignIn(*holder, Of("users/jane", "1")).ok());
  EXPECT_FALSE(Begin(Of("users/joe", "2")));
  EXPECT_TRUE(holder->Commit().ok());
}

// The database's clock cannot be set here: what was dated while it was ahead is written as if it had been.
TEST_F(AccountsTest, AnEndCoversASessionThatAClockAheadDated) {
  ASSERT_TRUE(*In([](Transaction& t) { return InsertAccount(t, Jane()); }));
  const auto first = In([](Transaction& t) { return BeginSession(t, "users/jane"); });
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->since, first->now);
  Do("UPDATE accounts SET newest_session_at = newest_session_at + interval '40 minutes'");
  // A sign-in since, by the clock that is right again, does not hide it.
  ASSERT_TRUE(In([](Transaction& t) { return BeginSession(t, "users/jane"); }).ok());
  ASSERT_TRUE(In([](Transaction& t) { return EndSessions(t, "users/jane"); }).ok());
  const auto ended = In([](Transaction& t) { return SessionsEndedBefore(t, "users/jane"); });
  EXPECT_EQ(**ended, first->since + std::chrono::minutes(40));
  // And the next one begins after that end.
  const auto next = In([](Transaction& t) { return BeginSession(t, "users/jane"); });
  ASSERT_TRUE(next.ok()) << next.status();
  EXPECT_EQ(next->since, **ended + std::chrono::microseconds(1));
  EXPECT_LT(next->now, next->since);
  ASSERT_TRUE(In([](Transaction& t) { return EndSessions(t, "users/jane"); }).ok());
  EXPECT_GE(**In([](Transaction& t) { return SessionsEndedBefore(t, "users/jane"); }), next->since);
  auto transaction = database_->Begin(Soon());
  EXPECT_FALSE(BeginSession(*transaction, "users/nobody").ok());
}

// By whatever the plant knows a person: what was recorded of him, a clearance, a certificate that waits.
TEST_F(AccountsTest, SomebodyIsWhomThePlantKnowsByAnything) {
  const auto is_somebody = [&](const std::string& name) {
    const auto known = In([&](Transaction& t) { return IsSomebody(t, name); });
    EXPECT_TRUE(known.ok()) << known.status();
    return known.value_or(false);
  };
  for (const char* name : {"users/jane", "users/joe", "users/ann"}) EXPECT_FALSE(is_somebody(name)) << name;
  Do("SELECT pseudonym_of('users/jane via services/inspection')");
  EXPECT_TRUE(is_somebody("users/jane"));
  EXPECT_FALSE(is_somebody("users/jan"));
  Do("INSERT INTO credential_offers (pickup_sha256, sealed, identity, offered_by, expires_at) "
     "VALUES (sha256('x'), 'x', 'users/joe', 'users/it', clock_timestamp() + interval '1 hour')");
  EXPECT_TRUE(is_somebody("users/joe"));
  EXPECT_FALSE(is_somebody("users/ann"));
  Do("SELECT forget_person('jane')");
  EXPECT_FALSE(is_somebody("users/jane"));
}

}  // namespace
}  // namespace sixpoint::storage
