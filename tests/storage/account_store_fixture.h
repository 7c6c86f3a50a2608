// An AccountStore under test, PostgreSQL's and the fake that handlers are tested on: what accounts and sign-ins are tried with.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/account_store.h"
#include "tests/support/fake_accounts.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {

inline const StillWanted kSignInWanted = [] { return true; };
inline const StillWanted kSignInNotWanted = [] { return false; };

inline AccountRow WithPassword(const std::string& name, const std::vector<std::string>& roles = {"engineer"}) {
  AccountRow row;
  row.name = name;
  row.sign_in_method = "password";
  row.roles = roles;
  row.password_phc = "$argon2id$ of " + name;
  return row;
}

inline VouchedPerson OfSubject(const std::string& subject, const std::string& name, bool is_linked = false,
                               const std::vector<std::string>& roles = {"engineer"}) {
  VouchedPerson person;
  person.account.name = name;
  person.account.sign_in_method = "oidc";
  person.account.roles = roles;
  person.account.issuer = "https://id.plant.example";
  person.account.issuer_subject = subject;
  person.is_linked = is_linked;
  return person;
}

inline FailureCounters CountersOf(const std::string& account, const std::string& address = "1",
                                  int free_of_address = 20) {
  return {FailureCounter{account, 5}, FailureCounter{address, free_of_address}};
}

// What became of one sign-in.
struct TriedSignIn {
  absl::Status status;
  bool is_judged = false;
  std::optional<AccountRow> judged;   // by which account; none: by none
  std::optional<SessionStart> start;  // none: no session was begun
};

struct AccountStoreUnderTest {
  AccountStore& store;
  std::function<void(const std::string& name)> see;         // something is recorded of somebody without an account
  std::function<void(std::chrono::seconds time)> let_pass;  // failed sign-ins are so much older
  // Sessions of an account were ended by a clock that was ahead.
  std::function<void(const std::string& account, std::chrono::seconds ahead)> end_ahead;
  std::function<std::vector<std::string>()> events;  // users/jane created engineer by users/it
  std::function<int()> failed_count;

  AccountRow Create(const AccountRow& row) const {
    const auto created = store.Create(row, "users/it", kSignInWanted, sixpoint::testing::Soon());
    EXPECT_TRUE(created.ok()) << created.status();
    return created.value_or(AccountRow());
  }
  std::optional<AccountRow> Find(const std::string& name) const {
    const auto found = store.Find(name, sixpoint::testing::Soon());
    EXPECT_TRUE(found.ok()) << found.status();
    return found.value_or(std::nullopt);
  }
  std::vector<std::string> Names(const std::string& after_name, int limit, const AccountFilter& filter = {}) const {
    const auto listed = store.List(filter, after_name, limit, sixpoint::testing::Soon());
    EXPECT_TRUE(listed.ok()) << listed.status();
    std::vector<std::string> names;
    for (const AccountRow& row : listed.value_or(std::vector<AccountRow>())) names.push_back(row.name);
    return names;
  }
  absl::StatusOr<std::optional<AccountRow>> Change(const std::string& name, const AccountDeed& deed,
                                                   const AccountChange& change,
                                                   const StillWanted& still_wanted = kSignInWanted) const {
    return store.Change(name, change, deed, still_wanted, sixpoint::testing::Soon());
  }
  SignInLook Begin(const FailureCounters& counters, const std::string& name = "users/nobody") const {
    const auto begun = store.BeginSignIn(counters, name, kSignInWanted, sixpoint::testing::Soon());
    EXPECT_TRUE(begun.ok()) << begun.status();
    const SignInLook look = begun.value_or(SignInLook());
    EXPECT_NE(look.start.waits_until.has_value(), look.start.counted_at.has_value());
    return look;
  }
  bool Waits(const FailureCounters& counters) const { return Begin(counters).start.waits_until.has_value(); }

  using StoreSignIn = std::function<absl::Status(const SignInOrder& order)>;
  // judged, given: what the two functions say.
  TriedSignIn Try(const FailureCounters& counters, const StoreSignIn& sign_in, const absl::Status& judged,
                  const absl::Status& given) const {
    TriedSignIn tried;
    SignInOrder order;
    order.counted = {counters, Begin(counters).start.counted_at.value_or(Instant())};
    order.requested_by = "services/gateway";
    order.judge = [&](const std::optional<AccountRow>& account) {
      tried.is_judged = true;
      tried.judged = account;
      return account || !judged.ok() ? judged : absl::UnauthenticatedError("no account");
    };
    order.begun = [&](const AccountRow&, const SessionStart& start) {
      tried.start = start;
      return given;
    };
    tried.status = sign_in(order);
    return tried;
  }
  TriedSignIn SignIn(const std::string& name, const absl::Status& judged = absl::OkStatus(),
                     const absl::Status& given = absl::OkStatus(),
                     const StillWanted& still_wanted = kSignInWanted) const {
    return Try(
        CountersOf(name),
        [&](const SignInOrder& order) { return store.SignIn(name, order, still_wanted, sixpoint::testing::Soon()); },
        judged, given);
  }
  TriedSignIn SignIn(const VouchedPerson& person, const absl::Status& judged = absl::OkStatus(),
                     const StillWanted& still_wanted = kSignInWanted) const {
    return Try(
        {std::nullopt, FailureCounter{"1", 20}},
        [&](const SignInOrder& order) {
          return store.SignInOfSubject(person, order, still_wanted, sixpoint::testing::Soon());
        },
        judged, absl::OkStatus());
  }
  SessionLook Look(const std::string& account, Instant since) const {
    const auto look = store.LookAtSession(account, since, sixpoint::testing::Soon());
    EXPECT_TRUE(look.ok()) << look.status();
    return look.value_or(SessionLook());
  }
  bool SignOut(const std::string& account, Instant since, std::chrono::hours lasts = std::chrono::hours(12)) const {
    const auto ended = store.SignOut(account, since, since + lasts, account + " via services/gateway", kSignInWanted,
                                     sixpoint::testing::Soon());
    EXPECT_TRUE(ended.ok()) << ended.status();
    return ended.value_or(false);
  }
};

inline void OnTheFake(const std::function<void(const AccountStoreUnderTest& accounts)>& test) {
  SCOPED_TRACE("the fake");
  sixpoint::testing::FakeAccounts fake;
  const auto events = [&] {
    std::vector<std::string> told;
    for (const auto& one : fake.events()) {
      std::string roles;
      for (const std::string& role : one.roles) roles += (roles.empty() ? "" : "+") + role;
      told.push_back(one.account + " " + AccountEventText(one.event) + " " + roles + " by " + one.requested_by);
    }
    return told;
  };
  test({fake, [&](const std::string& name) { fake.See(name); }, [&](std::chrono::seconds time) { fake.LetPass(time); },
        [&](const std::string& account, std::chrono::seconds ahead) { fake.EndAhead(account, ahead); }, events,
        [&] { return fake.FailedCount(); }});
}

// As the plant's own role keeps them; what no service does is done as the owner.
inline void OnPostgreSql(const std::function<void(const AccountStoreUnderTest& accounts)>& test) {
  SCOPED_TRACE("PostgreSQL");
  sixpoint::testing::ThrowawayDatabase throwaway;
  const auto as_plant = Database::Open(sixpoint::testing::AsRole(throwaway.conninfo(), "plant"), 4);
  const auto texts = [&](const std::string& sql, const Params& params = {}) {
    Transaction transaction = *throwaway.database()->Begin(sixpoint::testing::Soon());
    const auto rows = transaction.Execute(sql, params);
    EXPECT_TRUE(rows.ok()) << rows.status();
    EXPECT_TRUE(transaction.Commit().ok());
    std::vector<std::string> read;
    for (int row = 0; rows.ok() && row < rows->count(); ++row) read.push_back(rows->Text(row, 0));
    return read;
  };
  test({*AccountsIn(as_plant.get()),
        [&](const std::string& name) { texts("SELECT pseudonym_of($1)", Params().Text(name)); },
        [&](std::chrono::seconds time) {
          texts(
              "UPDATE sign_in_failures SET first_failed_at = first_failed_at - make_interval(secs => $1::integer), "
              "last_failed_at = last_failed_at - make_interval(secs => $1::integer), "
              "blocked_until = blocked_until - make_interval(secs => $1::integer)",
              Params().Int(time.count()));
        },
        [&](const std::string& account, std::chrono::seconds ahead) {
          texts(
              "UPDATE session_ends SET ended_before = clock_timestamp() + make_interval(secs => $2::integer) "
              "WHERE account = $1",
              Params().Text(account).Int(ahead.count()));
        },
        [&] {
          return texts(
              "SELECT name_of(subject) || ' ' || event || ' ' || array_to_string(roles, '+') || ' by ' || "
              "name_of(requested_by) FROM account_events ORDER BY event_id");
        },
        [&] { return std::stoi(texts("SELECT coalesce(sum(failed_count), 0)::text FROM sign_in_failures").at(0)); }});
}

// Each test runs on both.
inline void OnBothAccountStores(const std::function<void(const AccountStoreUnderTest& accounts)>& test) {
  OnTheFake(test);
  OnPostgreSql(test);
}

}  // namespace sixpoint::storage
