// What every ClearanceStore does, PostgreSQL's and the fake that handlers are tested on. What clearances let a reader see is
// clearances_test.cc's.
#include "storage/clearance_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "storage/reasons.h"
#include "tests/support/fake_clearance_store.h"
#include "tests/support/some_uuid.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::FakeClearanceStore;
using sixpoint::testing::kSomeUuid;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const StillWanted kClearanceWanted = [] { return true; };

ClearanceOrder JaneFor(const std::string& scope, const std::string& request_id = NewUuid(),
                       const std::string& requested_by = "users/it") {
  return {"users/jane", scope, requested_by, request_id};
}

absl::StatusOr<ClearanceRow> GrantNow(ClearanceStore& store, const ClearanceOrder& order) {
  return store.Grant(order, kClearanceWanted, Soon());
}

absl::StatusOr<std::optional<ClearanceRow>> WithdrawNow(ClearanceStore& store, const ClearanceOrder& order) {
  return store.Withdraw(order, kClearanceWanted, Soon());
}

std::vector<ClearanceRow> ListedClearances(const ClearanceStore& store, const ClearanceFilter& filter = {},
                                           std::int64_t before_sequence = 0, int limit = 100) {
  const auto listed = store.List(filter, before_sequence, limit, Soon());
  EXPECT_TRUE(listed.ok()) << listed.status();
  return listed.value_or(std::vector<ClearanceRow>());
}

std::vector<std::string> ScopesOf(const std::vector<ClearanceRow>& rows) {
  std::vector<std::string> scopes;
  for (const ClearanceRow& row : rows) scopes.push_back(row.scope);
  return scopes;
}

// Each test runs on both.
void OnBothClearanceStores(const std::function<void(ClearanceStore& store)>& test) {
  {
    SCOPED_TRACE("the fake");
    FakeClearanceStore fake;
    test(fake);
  }
  SCOPED_TRACE("PostgreSQL");
  sixpoint::testing::ThrowawayDatabase database;
  test(*ClearanceStoreIn(database.database()));
}

TEST(ClearanceStore, WhatIsGrantedHoldsAndIsGrantedOnce) {
  OnBothClearanceStores([](ClearanceStore& store) {
    const auto granted = GrantNow(store, JaneFor("parts/vane"));
    ASSERT_TRUE(granted.ok()) << granted.status();
    EXPECT_EQ(granted->holder, "users/jane");
    EXPECT_EQ(granted->scope, "parts/vane");
    EXPECT_EQ(granted->granted_by, "users/it");
    EXPECT_GT(granted->granted_sequence, 0);
    EXPECT_NE(granted->granted_at, Instant());
    EXPECT_FALSE(granted->withdrawn_at.has_value());
    EXPECT_EQ(granted->withdrawn_by, "");
    const auto again = GrantNow(store, JaneFor("parts/vane", NewUuid(), "users/another"));
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->granted_sequence, granted->granted_sequence);
    EXPECT_EQ(again->granted_by, "users/it");
    EXPECT_EQ(ListedClearances(store).size(), 1u);
  });
}

TEST(ClearanceStore, WhatIsWithdrawnStaysAsItWasAndMayBeGrantedAnew) {
  OnBothClearanceStores([](ClearanceStore& store) {
    const auto granted = GrantNow(store, JaneFor("parts/vane"));
    ASSERT_TRUE(granted.ok()) << granted.status();
    const auto withdrawn = WithdrawNow(store, JaneFor("parts/vane", NewUuid(), "users/boss"));
    ASSERT_TRUE(withdrawn.ok() && withdrawn->has_value()) << withdrawn.status();
    EXPECT_EQ((**withdrawn).granted_sequence, granted->granted_sequence);
    EXPECT_EQ((**withdrawn).withdrawn_by, "users/boss");
    ASSERT_TRUE((**withdrawn).withdrawn_at.has_value());
    EXPECT_GE(*(**withdrawn).withdrawn_at, granted->granted_at);
    const auto again = WithdrawNow(store, JaneFor("parts/vane"));
    ASSERT_TRUE(again.ok() && again->has_value()) << again.status();
    EXPECT_EQ((**again).withdrawn_by, "users/boss");
    EXPECT_EQ((**again).withdrawn_at, (**withdrawn).withdrawn_at);
    EXPECT_THAT(ListedClearances(store), IsEmpty());

    const auto anew = GrantNow(store, JaneFor("parts/vane"));
    ASSERT_TRUE(anew.ok()) << anew.status();
    EXPECT_GT(anew->granted_sequence, granted->granted_sequence);
    EXPECT_FALSE(anew->withdrawn_at.has_value());
    const std::vector<ClearanceRow> all = ListedClearances(store, {"", "", true});
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].granted_sequence, anew->granted_sequence);
    EXPECT_EQ(all[1].withdrawn_by, "users/boss");
  });
}

TEST(ClearanceStore, WhatWasNeverGrantedIsNotWithdrawn) {
  OnBothClearanceStores([](ClearanceStore& store) {
    ASSERT_TRUE(GrantNow(store, JaneFor("parts/vane")).ok());
    const auto nothing = WithdrawNow(store, JaneFor("parts/blade", kSomeUuid));
    ASSERT_TRUE(nothing.ok()) << nothing.status();
    EXPECT_FALSE(nothing->has_value());
    EXPECT_FALSE(WithdrawNow(store, {"users/joe", "parts/vane", "users/it", NewUuid()})->has_value());
    // Nothing was recorded under that id.
    EXPECT_TRUE(GrantNow(store, JaneFor("parts/blade", kSomeUuid)).ok());
  });
}

// A request that was long on its way.
TEST(ClearanceStore, ARequestThatComesAgainAfterTheOppositeChangesNothing) {
  OnBothClearanceStores([](ClearanceStore& store) {
    const ClearanceOrder grant = JaneFor("parts/vane"), grant_once_more = JaneFor("parts/vane");
    const ClearanceOrder withdrawal = JaneFor("parts/vane", NewUuid(), "users/boss");
    ASSERT_TRUE(GrantNow(store, grant).ok());
    ASSERT_TRUE(GrantNow(store, grant_once_more).ok());  // without effect, and kept
    ASSERT_TRUE(WithdrawNow(store, withdrawal).ok());
    for (const ClearanceOrder& late : {grant, grant_once_more}) {
      const auto stands = GrantNow(store, late);
      ASSERT_TRUE(stands.ok()) << stands.status();
      EXPECT_EQ(stands->withdrawn_by, "users/boss");
    }
    EXPECT_THAT(ListedClearances(store), IsEmpty());
    const auto anew = GrantNow(store, JaneFor("parts/vane"));
    ASSERT_TRUE(anew.ok()) << anew.status();
    const auto stands = WithdrawNow(store, withdrawal);
    ASSERT_TRUE(stands.ok() && stands->has_value()) << stands.status();
    EXPECT_EQ((**stands).granted_sequence, anew->granted_sequence);
    EXPECT_FALSE((**stands).withdrawn_at.has_value());
  });
}

TEST(ClearanceStore, ARequestIdIsOfOneRequest) {
  OnBothClearanceStores([](ClearanceStore& store) {
    ASSERT_TRUE(GrantNow(store, JaneFor("parts/vane", kSomeUuid)).ok());
    ASSERT_TRUE(GrantNow(store, JaneFor("parts/blade")).ok());
    for (const absl::Status& refused : {GrantNow(store, JaneFor("parts/blade", kSomeUuid)).status(),
                                        GrantNow(store, {"users/joe", "parts/vane", "users/it", kSomeUuid}).status(),
                                        WithdrawNow(store, JaneFor("parts/vane", kSomeUuid)).status()}) {
      EXPECT_EQ(refused.code(), absl::StatusCode::kAlreadyExists) << refused;
      EXPECT_EQ(refused.GetPayload(kReasonPayload), kRequestIdReused);
    }
    for (const char* request_id : {"", "one"})
      EXPECT_EQ(GrantNow(store, JaneFor("parts/vane", request_id)).status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(ScopesOf(ListedClearances(store)), ElementsAre("parts/blade", "parts/vane"));
  });
}

TEST(ClearanceStore, ListsGrantedLastFirstByFiltersAndByPages) {
  OnBothClearanceStores([](ClearanceStore& store) {
    for (const char* scope : {"parts/vane", "customers/acme", "parts/blade"})
      ASSERT_TRUE(GrantNow(store, JaneFor(scope)).ok());
    ASSERT_TRUE(GrantNow(store, {"machines/m1", "parts/vane", "users/it", NewUuid()}).ok());
    ASSERT_TRUE(WithdrawNow(store, JaneFor("customers/acme")).ok());
    EXPECT_THAT(ScopesOf(ListedClearances(store)), ElementsAre("parts/vane", "parts/blade", "parts/vane"));
    EXPECT_THAT(ScopesOf(ListedClearances(store, {"users/jane", "", false})), ElementsAre("parts/blade", "parts/vane"));
    EXPECT_THAT(ScopesOf(ListedClearances(store, {"users/jane", "", true})),
                ElementsAre("parts/blade", "customers/acme", "parts/vane"));
    EXPECT_THAT(ListedClearances(store, {"users/joe", "", true}), IsEmpty());
    const std::vector<ClearanceRow> vanes = ListedClearances(store, {"", "parts/vane", false});
    ASSERT_EQ(vanes.size(), 2u);
    EXPECT_EQ(vanes[0].holder, "machines/m1");
    EXPECT_EQ(ListedClearances(store, {"users/jane", "parts/vane", false}).size(), 1u);
    EXPECT_EQ(ScopesOf(ListedClearances(store, {}, 0, 1)), ScopesOf({vanes[0]}));
    EXPECT_THAT(ScopesOf(ListedClearances(store, {}, vanes[0].granted_sequence, 1)), ElementsAre("parts/blade"));
    EXPECT_THAT(ListedClearances(store, {}, vanes[1].granted_sequence), IsEmpty());
  });
}

TEST(ClearanceStore, WhatIsWantedNoMoreIsNotDone) {
  OnBothClearanceStores([](ClearanceStore& store) {
    const auto is_gone = [] { return false; };
    EXPECT_EQ(store.Grant(JaneFor("parts/vane"), is_gone, Soon()).status().code(), absl::StatusCode::kCancelled);
    EXPECT_THAT(ListedClearances(store, {"", "", true}), IsEmpty());
    ASSERT_TRUE(GrantNow(store, JaneFor("parts/vane")).ok());
    EXPECT_EQ(store.Withdraw(JaneFor("parts/vane"), is_gone, Soon()).status().code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(ListedClearances(store).size(), 1u);
  });
}

}  // namespace
}  // namespace sixpoint::storage
