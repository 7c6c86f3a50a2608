// What every AccountStore keeps of accounts. Whom the plant knows by what, and what the schema refuses, is tested in accounts_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/storage/account_store_fixture.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(AccountStore, OneIsMadeOnceAndStandsAsItWasMade) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    EXPECT_FALSE(accounts.Find("users/jane").has_value());
    const AccountRow made = accounts.Create(WithPassword("users/jane", {"quality", "admin"}));
    EXPECT_EQ(made.name, "users/jane");
    EXPECT_EQ(made.sign_in_method, "password");
    EXPECT_THAT(made.roles, ElementsAre("quality", "admin"));
    EXPECT_EQ(made.password_phc, "$argon2id$ of users/jane");
    EXPECT_EQ(made.issuer + made.issuer_subject, "");
    EXPECT_FALSE(made.disabled);
    EXPECT_NE(made.created_at, Instant());
    EXPECT_NE(made.changed_at, Instant());
    AccountRow other = WithPassword("users/jane");
    other.password_phc = "$argon2id$ of another";
    EXPECT_EQ(accounts.Create(other).password_phc, made.password_phc);
    EXPECT_THAT(accounts.Find("users/jane")->roles, ElementsAre("quality", "admin"));
    EXPECT_THAT(accounts.events(), ElementsAre("users/jane created quality+admin by users/it"));
  });
}

TEST(AccountStore, AreListedByNameByteForByte) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    EXPECT_THAT(accounts.Names("users/", 10), IsEmpty());
    for (const char* name : {"users/c", "users/a", "users/B"}) accounts.Create(WithPassword(name));
    EXPECT_THAT(accounts.Names("users/", 2), ElementsAre("users/B", "users/a"));
    EXPECT_THAT(accounts.Names("users/a", 2), ElementsAre("users/c"));
    EXPECT_THAT(accounts.Names("users/c", 2), IsEmpty());
  });
}

TEST(AccountStore, AreListedByRoleAndByWhetherSomebodyMaySignIn) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    for (const char* name : {"users/a", "users/b", "users/c"}) accounts.Create(WithPassword(name));
    ASSERT_TRUE(accounts
                    .Change("users/a", {AccountEvent::kDisabled, true, "users/it"},
                            [](AccountRow* row) { return row->disabled = true; })
                    .ok());
    ASSERT_TRUE(accounts
                    .Change("users/b", {AccountEvent::kRolesSet, true, "users/it"},
                            [](AccountRow* row) {
                              row->roles = {"mes-reader"};
                              return true;
                            })
                    .ok());
    EXPECT_THAT(accounts.Names("users/", 10, {"engineer", false}), ElementsAre("users/a", "users/c"));
    EXPECT_THAT(accounts.Names("users/", 10, {"engineer", true}), ElementsAre("users/c"));
    EXPECT_THAT(accounts.Names("users/", 1, {"engineer", false}), ElementsAre("users/a"));
    EXPECT_THAT(accounts.Names("users/", 10, {"mes-reader", true}), ElementsAre("users/b"));
    EXPECT_THAT(accounts.Names("users/", 10, {"admin", false}), IsEmpty());
    EXPECT_THAT(accounts.Names("users/", 1, {"", true}),
                ElementsAre("users/b"));  // a page of one, of what is asked for
  });
}

TEST(AccountStore, WhatIsChangedIsKeptWithItsEventAndEndsSessionsWhereItIsToldTo) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    const AccountRow made = accounts.Create(WithPassword("users/jane"));
    const Instant since = accounts.SignIn("users/jane").start.value().since;
    const auto disabled =
        accounts.Change("users/jane", {AccountEvent::kDisabled, false, "users/it"}, [](AccountRow* account) {
          account->disabled = true;
          return true;
        });
    ASSERT_TRUE(disabled.ok() && disabled->has_value()) << disabled.status();
    EXPECT_TRUE((**disabled).disabled);
    EXPECT_EQ((**disabled).created_at, made.created_at);
    EXPECT_GE((**disabled).changed_at, made.changed_at);
    EXPECT_FALSE(accounts.Look("users/jane", since).is_ended);
    const auto changed =
        accounts.Change("users/jane", {AccountEvent::kRolesSet, true, "users/boss"}, [](AccountRow* account) {
          EXPECT_TRUE(account->disabled);  // as it stands
          account->roles = {"quality"};
          account->password_phc = "$argon2id$ of later";
          return true;
        });
    ASSERT_TRUE(changed.ok() && changed->has_value()) << changed.status();
    EXPECT_TRUE(accounts.Look("users/jane", since).is_ended);
    const AccountRow after = accounts.Find("users/jane").value();
    EXPECT_THAT(after.roles, ElementsAre("quality"));
    EXPECT_EQ(after.password_phc, "$argon2id$ of later");
    EXPECT_TRUE(after.disabled);
    EXPECT_THAT(
        accounts.events(),
        ElementsAre("users/jane created engineer by users/it", "users/jane signed_in engineer by services/gateway",
                    "users/jane disabled engineer by users/it", "users/jane roles_set quality by users/boss"));
  });
}

TEST(AccountStore, WhatIsSoAlreadyOrRefusedOrOfNobodyIsNotChanged) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    accounts.Create(WithPassword("users/jane"));
    const Instant since = accounts.SignIn("users/jane").start.value().since;
    const AccountDeed deed{AccountEvent::kRolesSet, true, "users/it"};
    const auto as_it_is = accounts.Change("users/jane", deed, [](AccountRow*) { return false; });
    ASSERT_TRUE(as_it_is.ok() && as_it_is->has_value()) << as_it_is.status();
    EXPECT_THAT((**as_it_is).roles, ElementsAre("engineer"));
    const auto refused = accounts.Change("users/jane", deed, [](AccountRow* account) -> absl::StatusOr<bool> {
      account->roles = {"admin"};
      return absl::AbortedError("not so");
    });
    EXPECT_EQ(refused.status(), absl::AbortedError("not so"));
    EXPECT_EQ(*accounts.Change("users/nobody", deed, [](AccountRow*) { return true; }), std::nullopt);
    EXPECT_THAT(accounts.Find("users/jane")->roles, ElementsAre("engineer"));
    EXPECT_FALSE(accounts.Look("users/jane", since).is_ended);
    EXPECT_EQ(accounts.events().size(), 2u);
  });
}

TEST(AccountStore, WhatIsWantedNoMoreIsNotDone) {
  OnBothAccountStores([](const AccountStoreUnderTest& accounts) {
    EXPECT_EQ(accounts.store.Create(WithPassword("users/joe"), "users/it", kSignInNotWanted, Soon()).status().code(),
              absl::StatusCode::kCancelled);
    EXPECT_FALSE(accounts.Find("users/joe").has_value());
    accounts.Create(WithPassword("users/jane"));
    const auto disable = [](AccountRow* account) {
      account->disabled = true;
      return true;
    };
    EXPECT_EQ(accounts.Change("users/jane", {AccountEvent::kDisabled, true, "users/it"}, disable, kSignInNotWanted)
                  .status()
                  .code(),
              absl::StatusCode::kCancelled);
    EXPECT_FALSE(accounts.Find("users/jane")->disabled);
    EXPECT_EQ(accounts.events().size(), 1u);
  });
}

}  // namespace
}  // namespace sixpoint::storage
