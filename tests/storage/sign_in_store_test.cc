// What every AccountStore does of sign-ins and sessions. How waits grow, and what becomes of them where many try, is tested in
// accounts_test.cc on PostgreSQL, too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/storage/account_store_fixture.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using std::chrono::hours;
using std::chrono::microseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;

TEST(SignInStore, ASignInIsJudgedByItsAccountAndBeginsASession) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    const AccountRow made = accounts.Create(WithPassword("users/jane"));
    const SignInLook looked =
        accounts.store.LookAtSignIn(CountersOf("users/jane"), "users/jane", Soon()).value_or(SignInLook());
    EXPECT_EQ(looked.account.value().password_phc, made.password_phc);
    EXPECT_FALSE(looked.start.waits_until || looked.start.counted_at);
    EXPECT_EQ(accounts.Begin(CountersOf("users/jane"), "users/jane").account.value().name, "users/jane");
    EXPECT_FALSE(accounts.Begin(CountersOf("users/joe"), "users/joe").account.has_value());
    EXPECT_EQ(accounts.failed_count(), 4);  // two accounts, and their address for each
    const TriedSignIn tried = accounts.SignIn("users/jane");
    ASSERT_TRUE(tried.status.ok()) << tried.status;
    EXPECT_EQ(tried.judged.value().name, "users/jane");
    EXPECT_EQ(tried.start.value().since, tried.start->now);
    EXPECT_EQ(accounts.failed_count(), 3);  // the account began anew, the address is given back its own
    const SessionLook look = accounts.Look("users/jane", tried.start->since);
    EXPECT_EQ(look.account.value().name, "users/jane");
    EXPECT_FALSE(look.is_ended);
    EXPECT_GE(look.now, tried.start->now);
    EXPECT_FALSE(accounts.Look("users/joe", tried.start->since).account.has_value());
  });
}

TEST(SignInStore, WhoIsRefusedOrGetsNoSessionIsNotSignedIn) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    accounts.Create(WithPassword("users/jane"));
    const absl::Status no = absl::UnauthenticatedError("no"), unsigned_one = absl::InternalError("unsigned");
    const TriedSignIn refused = accounts.SignIn("users/jane", no);
    EXPECT_EQ(refused.status, no);
    EXPECT_FALSE(refused.start.has_value());
    const TriedSignIn of_nobody = accounts.SignIn("users/joe");
    EXPECT_TRUE(of_nobody.is_judged && !of_nobody.judged);
    EXPECT_FALSE(of_nobody.status.ok());
    EXPECT_EQ(accounts.SignIn("users/jane", absl::OkStatus(), unsigned_one).status, unsigned_one);
    EXPECT_EQ(accounts.failed_count(), 6);
    EXPECT_EQ(accounts.events().size(), 1u);
  });
}

// As the counters of storage/sign_in_failures.h.
TEST(SignInStore, AfterFiveFailuresTheNextWaitsLongerAndLonger) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    const FailureCounters jane = CountersOf("users/jane", "1", 100);
    for (int i = 0; i < 5; ++i) EXPECT_FALSE(accounts.Waits(jane)) << i;
    for (const seconds wait : {seconds(30), seconds(60), seconds(120)}) {
      const Instant now = accounts.Look("users/jane", Instant()).now;
      const SignInLook waits = accounts.Begin(jane);
      ASSERT_TRUE(waits.start.waits_until.has_value()) << wait.count();
      EXPECT_LE(*waits.start.waits_until, now + wait);
      EXPECT_GT(*waits.start.waits_until, now + wait / 2);
      const auto looked = accounts.store.LookAtSignIn(jane, "users/jane", Soon());
      EXPECT_EQ(looked.value_or(SignInLook()).start.waits_until, waits.start.waits_until);
      accounts.let_pass(wait + seconds(1));
      EXPECT_FALSE(accounts.store.LookAtSignIn(jane, "", Soon())->start.waits_until.has_value());
      EXPECT_FALSE(accounts.Waits(jane)) << wait.count();  // and fails once more
    }
    EXPECT_FALSE(accounts.Waits(CountersOf("users/joe", "1", 100)));
    // Quiet for a quarter of an hour after the last wait: as new.
    accounts.let_pass(hours(1));
    for (int i = 0; i < 5; ++i) EXPECT_FALSE(accounts.Waits(jane)) << i;
    EXPECT_TRUE(accounts.Waits(jane));
    // What is long over is forgotten.
    accounts.let_pass(hours(2));
    EXPECT_GT(accounts.failed_count(), 0);
    EXPECT_TRUE(accounts.store.ForgetSignInFailures(Soon()).ok());
    EXPECT_EQ(accounts.failed_count(), 0);
  });
}

TEST(SignInStore, AnAddressIsCountedByItself) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    for (const char* name : {"a", "b", "c"}) EXPECT_FALSE(accounts.Waits(CountersOf(name, "1", 3))) << name;
    EXPECT_TRUE(accounts.Waits(CountersOf("d", "1", 3)));
    EXPECT_FALSE(accounts.Waits(CountersOf("d", "2", 3)));
    // Whatever is typed as an account is none.
    EXPECT_FALSE(accounts.Waits({FailureCounter{"1", 5}, std::nullopt}));
    EXPECT_FALSE(accounts.Waits({std::nullopt, FailureCounter{"a", 5}}));
  });
}

TEST(SignInStore, WhatWentWellBeginsTheAccountAnewAndGivesTheAddressItsOwnBack) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    const FailureCounters jane = CountersOf("users/jane", "1", 6);
    SignInLook last;
    for (int i = 0; i < 4; ++i) last = accounts.Begin(jane);
    EXPECT_TRUE(accounts.store.SignInWentWell({jane, last.start.counted_at.value()}, kSignInWanted, Soon()).ok());
    EXPECT_EQ(accounts.failed_count(), 3);  // of the address
    for (int i = 0; i < 3; ++i) EXPECT_FALSE(accounts.Waits(jane)) << i;
    EXPECT_TRUE(accounts.Waits(CountersOf("users/joe", "1", 6)));
    EXPECT_FALSE(accounts.Waits(CountersOf("users/jane", "2", 6)));
  });
}

TEST(SignInStore, WhatIsGivenBackIsAsIfItHadNotBeenBegun) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    const FailureCounters jane = CountersOf("users/jane");
    const auto give_back = [&](const SignInLook& begun) {
      EXPECT_TRUE(accounts.store.GiveSignInBack({jane, begun.start.counted_at.value()}, Soon()).ok());
    };
    for (int i = 0; i < 7; ++i) give_back(accounts.Begin(jane));
    EXPECT_EQ(accounts.failed_count(), 0);
    // The wait that one alone brought goes with it.
    SignInLook fifth;
    for (int i = 0; i < 5; ++i) fifth = accounts.Begin(jane);
    EXPECT_TRUE(accounts.Waits(jane));
    give_back(fifth);
    const SignInLook slow = accounts.Begin(jane);
    EXPECT_TRUE(slow.start.counted_at.has_value());
    // Of a counter that began anew meanwhile nothing is taken.
    EXPECT_TRUE(
        accounts.store.SignInWentWell({{jane.account, std::nullopt}, *slow.start.counted_at}, kSignInWanted, Soon())
            .ok());
    EXPECT_FALSE(accounts.Waits({jane.account, std::nullopt}));
    const int before = accounts.failed_count();
    EXPECT_TRUE(accounts.store.GiveSignInBack({{jane.account, std::nullopt}, *slow.start.counted_at}, Soon()).ok());
    EXPECT_EQ(accounts.failed_count(), before);
  });
}

TEST(SignInStore, ManyAtOnceCountAsMany) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    std::atomic<int> let_in{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
      threads.emplace_back([&] {
        for (int j = 0; j < 4; ++j) let_in += accounts.Waits(CountersOf("users/jane", "1", 100)) ? 0 : 1;
      });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(let_in, 5);
  });
}

TEST(SignInStore, ASubjectOfAProviderHasAnAccountMadeForItAndTheRolesOfNow) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    const TriedSignIn first = accounts.SignIn(OfSubject("f3a1", "users/jane"));
    ASSERT_TRUE(first.status.ok()) << first.status;
    EXPECT_EQ(first.judged.value().name, "users/jane");
    const AccountRow made = accounts.Find("users/jane").value();
    EXPECT_EQ(made.sign_in_method, "oidc");
    EXPECT_EQ(made.issuer, "https://id.plant.example");
    EXPECT_EQ(made.issuer_subject, "f3a1");
    EXPECT_EQ(made.password_phc, "");
    // She is who she is, whatever she is called since.
    const TriedSignIn second = accounts.SignIn(OfSubject("f3a1", "users/married"));
    ASSERT_TRUE(second.status.ok()) << second.status;
    EXPECT_EQ(second.judged.value().name, "users/jane");
    EXPECT_FALSE(accounts.Find("users/married").has_value());
    EXPECT_FALSE(accounts.Look("users/jane", first.start.value().since).is_ended);
    const TriedSignIn third = accounts.SignIn(OfSubject("f3a1", "users/jane", false, {"quality"}));
    ASSERT_TRUE(third.status.ok()) << third.status;
    EXPECT_THAT(accounts.Find("users/jane")->roles, ElementsAre("quality"));
    EXPECT_TRUE(accounts.Look("users/jane", second.start.value().since).is_ended);
    EXPECT_FALSE(accounts.Look("users/jane", third.start.value().since).is_ended);
    EXPECT_THAT(accounts.events(), ElementsAre("users/jane created engineer by services/gateway",
                                               "users/jane signed_in engineer by services/gateway",
                                               "users/jane signed_in engineer by services/gateway",
                                               "users/jane roles_set quality by services/gateway",
                                               "users/jane signed_in quality by services/gateway"));
    // Who is judged not to come in changes nothing.
    const absl::Status no = absl::UnauthenticatedError("disabled");
    EXPECT_EQ(accounts.SignIn(OfSubject("f3a1", "users/jane"), no).status, no);
    EXPECT_EQ(accounts.SignIn(OfSubject("00b7", "users/joe"), no).status, no);
    EXPECT_THAT(accounts.Find("users/jane")->roles, ElementsAre("quality"));
    EXPECT_FALSE(accounts.Find("users/joe").has_value());
  });
}

TEST(SignInStore, ANameOfAnotherOneIsGivenToNoSubject) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    const auto is_refused = [&](const VouchedPerson& person) {
      const TriedSignIn tried = accounts.SignIn(person);
      EXPECT_EQ(tried.status.code(), absl::StatusCode::kUnauthenticated);
      return tried.is_judged && !tried.judged;
    };
    accounts.Create(WithPassword("users/jane"));  // by users/it
    accounts.see("users/joe");
    for (const char* name : {"users/jane", "users/it", "users/joe"})
      EXPECT_TRUE(is_refused(OfSubject("f3a1", name))) << name;
    // An account is nobody else's, whoever says so; who is known without one may be linked.
    EXPECT_TRUE(is_refused(OfSubject("f3a1", "users/jane", true)));
    EXPECT_EQ(accounts.events().size(), 1u);
    const TriedSignIn linked = accounts.SignIn(OfSubject("f3a1", "users/joe", true));
    ASSERT_TRUE(linked.status.ok()) << linked.status;
    EXPECT_EQ(linked.judged.value().name, "users/joe");
    EXPECT_TRUE(is_refused(OfSubject("00b7", "users/joe", true)));
  });
}

TEST(SignInStore, ASignOutEndsEverySessionOfItsAccountOnce) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    for (const char* name : {"users/jane", "users/joe"}) accounts.Create(WithPassword(name));
    const Instant first = accounts.SignIn("users/jane").start.value().since;
    const Instant second = accounts.SignIn("users/jane").start.value().since;
    const Instant of_joe = accounts.SignIn("users/joe").start.value().since;
    // By one that is over nothing ends.
    EXPECT_FALSE(accounts.SignOut("users/jane", first - hours(12)));
    EXPECT_FALSE(accounts.Look("users/jane", first).is_ended);
    EXPECT_TRUE(accounts.SignOut("users/jane", first));
    EXPECT_TRUE(accounts.Look("users/jane", first).is_ended);
    EXPECT_TRUE(accounts.Look("users/jane", second).is_ended);
    EXPECT_FALSE(accounts.Look("users/joe", of_joe).is_ended);
    EXPECT_FALSE(accounts.SignOut("users/jane", second));
    EXPECT_FALSE(accounts.SignOut("users/nobody", second));
    EXPECT_EQ(accounts.events().back(), "users/jane signed_out engineer by users/jane via services/gateway");
    EXPECT_EQ(accounts.events().size(), 6u);
    const TriedSignIn later = accounts.SignIn("users/jane");
    EXPECT_FALSE(accounts.Look("users/jane", later.start.value().since).is_ended);
  });
}

// An end that the clock has not reached, for it was set back: what begins then begins after it.
TEST(SignInStore, ASessionBeginsAfterAllThatEnded) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    accounts.Create(WithPassword("users/jane"));
    EXPECT_TRUE(accounts.SignOut("users/jane", accounts.SignIn("users/jane").start.value().since));
    accounts.end_ahead("users/jane", seconds(600));
    const SessionStart start = accounts.SignIn("users/jane").start.value();
    EXPECT_GT(start.since, start.now + seconds(500));
    EXPECT_FALSE(accounts.Look("users/jane", start.since).is_ended);
    EXPECT_TRUE(accounts.Look("users/jane", start.since - microseconds(1)).is_ended);
    EXPECT_TRUE(accounts.SignOut("users/jane", start.since));
    EXPECT_TRUE(accounts.Look("users/jane", start.since).is_ended);
  });
}

TEST(SignInStore, WhatIsWantedNoMoreIsNotDone) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    accounts.Create(WithPassword("users/jane"));
    const Instant since = accounts.SignIn("users/jane").start.value().since;
    const auto is_cancelled = [](const absl::Status& status) { return absl::IsCancelled(status); };
    const FailureCounters jane = CountersOf("users/jane");
    EXPECT_TRUE(is_cancelled(accounts.store.BeginSignIn(jane, "users/jane", kSignInNotWanted, Soon()).status()));
    EXPECT_EQ(accounts.failed_count(), 0);
    const SignInLook begun = accounts.Begin(jane);
    EXPECT_TRUE(
        is_cancelled(accounts.store.SignInWentWell({jane, begun.start.counted_at.value()}, kSignInNotWanted, Soon())));
    EXPECT_EQ(accounts.failed_count(), 2);
    EXPECT_TRUE(
        is_cancelled(accounts.SignIn("users/jane", absl::OkStatus(), absl::OkStatus(), kSignInNotWanted).status));
    EXPECT_EQ(accounts.failed_count(), 4);
    EXPECT_TRUE(
        is_cancelled(accounts.SignIn(OfSubject("f3a1", "users/joe"), absl::OkStatus(), kSignInNotWanted).status));
    EXPECT_FALSE(accounts.Find("users/joe").has_value());
    EXPECT_TRUE(is_cancelled(
        accounts.store.SignOut("users/jane", since, since + hours(12), "users/jane", kSignInNotWanted, Soon())
            .status()));
    EXPECT_FALSE(accounts.Look("users/jane", since).is_ended);
    EXPECT_EQ(accounts.events().size(), 2u);
  });
}

}  // namespace
}  // namespace sixpoint::storage
