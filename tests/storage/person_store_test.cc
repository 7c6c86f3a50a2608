// What every PersonStore does, PostgreSQL's and the fake that handlers are tested on. Who draws pseudonyms, and where they stand, is
// PostgreSQL's alone (persons_test.cc).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "storage/accounts.h"
#include "storage/persons.h"
#include "tests/support/fake_persons.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::FakePersons;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::UnorderedElementsAre;

const StillWanted kForgetWanted = [] { return true; };

struct PersonStoreUnderTest {
  PersonStore& store;
  std::function<void(const std::string& user_name)> see;  // something is recorded of that user
  // Once for each user with true, then with false: an account that counts, then one that is disabled.
  std::function<void(const std::string& user_name, bool counts)> set_account;

  std::vector<PersonRow> List(const PersonFilter& filter = {}, const std::string& after = "", int limit = 100) const {
    const auto listed = store.List(filter, after, limit, Soon());
    EXPECT_TRUE(listed.ok()) << listed.status();
    return listed.value_or(std::vector<PersonRow>());
  }
  PersonRow Known(const std::string& user_name) const {
    const std::vector<PersonRow> found = List({user_name, ""});
    EXPECT_EQ(found.size(), 1u) << user_name;
    return found.empty() ? PersonRow() : found.front();
  }
  absl::StatusOr<std::optional<ForgottenPerson>> Forget(const PersonFilter& whom) const {
    return store.Forget(whom, kForgetWanted, Soon());
  }
};

void SetPostgresAccount(Transaction& transaction, const std::string& user_name, bool counts) {
  AccountRow account;
  account.name = "users/" + user_name;
  account.sign_in_method = "password";
  account.roles = {"engineer"};
  account.password_phc = "$argon2id$";
  account.disabled = !counts;
  const auto inserted = InsertAccount(transaction, account);  // one that counts
  ASSERT_TRUE(inserted.ok()) << inserted.status();
  const absl::Status updated = UpdateAccount(transaction, account);
  ASSERT_TRUE(updated.ok()) << updated;
}

// Each test runs on both.
void OnBothPersonStores(const std::function<void(const PersonStoreUnderTest& persons)>& test) {
  {
    SCOPED_TRACE("the fake");
    FakePersons fake;
    test({fake, [&](const std::string& user_name) { fake.See(user_name); },
          [&](const std::string& user_name, bool counts) { fake.SetAccount(user_name, counts); }});
  }
  SCOPED_TRACE("PostgreSQL");
  ThrowawayDatabase database;
  const auto in_transaction = [&](const std::function<void(Transaction & transaction)>& work) {
    Transaction transaction = *database.database()->Begin(Soon());
    work(transaction);
    ASSERT_TRUE(transaction.Commit().ok());
  };
  const auto see = [&](const std::string& user_name) {
    in_transaction([&](Transaction& t) {
      const auto seen = t.Execute("SELECT pseudonym_of($1)", Params().Text("users/" + user_name));
      ASSERT_TRUE(seen.ok()) << seen.status();
    });
  };
  const auto set_account = [&](const std::string& user_name, bool counts) {
    in_transaction([&](Transaction& t) { SetPostgresAccount(t, user_name, counts); });
  };
  test({*PersonsIn(database.database()), see, set_account});
}

TEST(PersonStore, WhoWasSeenIsListedOnceByPseudonymAndByPages) {
  OnBothPersonStores([](const PersonStoreUnderTest& persons) {
    EXPECT_THAT(persons.List(), IsEmpty());
    for (const char* user_name : {"joe", "jane", "jim", "jane"}) persons.see(user_name);
    const std::vector<PersonRow> all = persons.List();
    ASSERT_EQ(all.size(), 3u);
    std::vector<std::string> user_names;
    for (const PersonRow& person : all) {
      EXPECT_THAT(person.pseudonym, MatchesRegex("[0-9a-f]{16}"));
      EXPECT_FALSE(person.forgotten_at.has_value());
      EXPECT_NE(person.first_seen_at, Instant());
      user_names.push_back(person.user_name.value_or("nobody"));
    }
    EXPECT_LT(all[0].pseudonym, all[1].pseudonym);
    EXPECT_LT(all[1].pseudonym, all[2].pseudonym);
    EXPECT_THAT(user_names, UnorderedElementsAre("jane", "jim", "joe"));
    const std::vector<PersonRow> page = persons.List({}, all[0].pseudonym, 1);
    ASSERT_EQ(page.size(), 1u);
    EXPECT_EQ(page[0].pseudonym, all[1].pseudonym);
    EXPECT_THAT(persons.List({}, all[2].pseudonym), IsEmpty());
  });
}

TEST(PersonStore, OneIsFoundByNameOrByPseudonym) {
  OnBothPersonStores([](const PersonStoreUnderTest& persons) {
    persons.see("jane");
    persons.see("joe");
    const PersonRow jane = persons.Known("jane");
    EXPECT_EQ(jane.user_name, "jane");
    const std::vector<PersonRow> found = persons.List({"", jane.pseudonym});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].user_name, "jane");
    EXPECT_THAT(persons.List({"joe", jane.pseudonym}), IsEmpty());
    EXPECT_THAT(persons.List({"jan", ""}), IsEmpty());
    EXPECT_THAT(persons.List({"", jane.pseudonym.substr(1)}), IsEmpty());
  });
}

TEST(PersonStore, WhoIsForgottenLeavesThePseudonymAndComesBackAsAnother) {
  OnBothPersonStores([](const PersonStoreUnderTest& persons) {
    persons.see("jane");
    persons.see("joe");
    const PersonRow jane = persons.Known("jane");
    const auto forgotten = persons.Forget({"jane", ""});
    ASSERT_TRUE(forgotten.ok() && forgotten->has_value()) << forgotten.status();
    EXPECT_TRUE((**forgotten).is_new);
    EXPECT_EQ((**forgotten).person.pseudonym, jane.pseudonym);
    EXPECT_EQ((**forgotten).person.user_name, std::nullopt);
    EXPECT_EQ((**forgotten).person.first_seen_at, jane.first_seen_at);
    ASSERT_TRUE((**forgotten).person.forgotten_at.has_value());
    EXPECT_GE(*(**forgotten).person.forgotten_at, jane.first_seen_at);
    EXPECT_EQ(persons.List({"", jane.pseudonym}).at(0).forgotten_at, (**forgotten).person.forgotten_at);
    EXPECT_EQ(persons.Known("joe").forgotten_at, std::nullopt);

    const auto again = persons.Forget({"", jane.pseudonym});
    ASSERT_TRUE(again.ok() && again->has_value()) << again.status();
    EXPECT_FALSE((**again).is_new);
    EXPECT_EQ((**again).person.forgotten_at, (**forgotten).person.forgotten_at);

    persons.see("jane");
    EXPECT_NE(persons.Known("jane").pseudonym, jane.pseudonym);
    EXPECT_EQ(persons.List().size(), 3u);
    EXPECT_TRUE((**persons.Forget({"", persons.Known("jane").pseudonym})).is_new);
  });
}

TEST(PersonStore, WhatNamesNobodyForgetsNobody) {
  OnBothPersonStores([](const PersonStoreUnderTest& persons) {
    persons.see("jane");
    for (const PersonFilter& whom : {PersonFilter{}, PersonFilter{"joe", ""}, PersonFilter{"", "0123456789abcdef"}}) {
      const auto forgotten = persons.Forget(whom);
      ASSERT_TRUE(forgotten.ok()) << forgotten.status();
      EXPECT_FALSE(forgotten->has_value());
    }
    ASSERT_TRUE(persons.Forget({"jane", ""}).ok());
    EXPECT_EQ(*persons.Forget({"jane", ""}), std::nullopt);
  });
}

TEST(PersonStore, WhoHasAnAccountThatCountsIsNotForgotten) {
  OnBothPersonStores([](const PersonStoreUnderTest& persons) {
    persons.see("jane");
    persons.set_account("jane", true);
    const absl::Status refused = persons.Forget({"jane", ""}).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(refused.message()), HasSubstr("users/jane, an account that counts, want it disabled"));
    EXPECT_EQ(persons.Known("jane").forgotten_at, std::nullopt);
    persons.set_account("jane", false);
    const auto forgotten = persons.Forget({"jane", ""});
    ASSERT_TRUE(forgotten.ok() && forgotten->has_value()) << forgotten.status();
    EXPECT_TRUE((**forgotten).is_new);
  });
}

TEST(PersonStore, WhatIsWantedNoMoreIsNotDone) {
  OnBothPersonStores([](const PersonStoreUnderTest& persons) {
    persons.see("jane");
    int asked = 0;
    const auto is_gone = [&] {
      ++asked;
      return false;
    };
    EXPECT_EQ(persons.store.Forget({"jane", ""}, is_gone, Soon()).status().code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(asked, 1);
    EXPECT_EQ(persons.Known("jane").forgotten_at, std::nullopt);
  });
}

}  // namespace
}  // namespace sixpoint::storage
