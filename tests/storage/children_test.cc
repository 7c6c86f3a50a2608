#include "storage/children.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using ::testing::ElementsAre;

struct Parent {
  std::string id;
  std::vector<std::int64_t> children = {};
};

absl::Status AddAll(const char* sql, std::vector<Parent>* parents) {
  sixpoint::testing::ThrowawayDatabase database(sixpoint::testing::ThrowawayDatabase::Schema::kEmpty);
  auto transaction = database.database()->Begin(sixpoint::testing::Soon());
  if (!transaction.ok()) return transaction.status();
  return ParentRows<Parent>(parents, &Parent::id)
      .Add(transaction->Execute(sql),
           [](Parent& parent, const Rows& rows, int row) { parent.children.push_back(rows.Int(row, 1)); });
}

TEST(ParentRows, GivesEachChildToItsParent) {
  std::vector<Parent> parents = {{"a"}, {"b"}};
  ASSERT_TRUE(AddAll("VALUES ('b', 1), ('a', 2), ('b', 3)", &parents).ok());
  EXPECT_THAT(parents[0].children, ElementsAre(2));
  EXPECT_THAT(parents[1].children, ElementsAre(1, 3));
}

TEST(ParentRows, AChildOfNobodyIsLostDataAndNoEndOfTheProcess) {
  std::vector<Parent> parents = {{"a"}};
  EXPECT_EQ(AddAll("VALUES ('c', 1)", &parents).code(), absl::StatusCode::kDataLoss);
}

TEST(ParentRows, SaysWhatCouldNotBeRead) {
  std::vector<Parent> parents = {{"a"}};
  EXPECT_EQ(AddAll("VALUES ('a', 'one')", &parents).code(), absl::StatusCode::kInternal);
  EXPECT_EQ(AddAll("VALUES (NULL, 1)", &parents).code(), absl::StatusCode::kInternal);
  EXPECT_FALSE(AddAll("no sql", &parents).ok());
}

}  // namespace
}  // namespace sixpoint::storage
