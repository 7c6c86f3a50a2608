// The kinds that the help of --kinds has are those of the journal, of the newest migration.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/list_filters.h"
#include "storage/events.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::cli {
namespace {

TEST(RecordKindsOfTheHelp, AreThoseOfTheJournal) {
  testing::ThrowawayDatabase database;
  absl::StatusOr<storage::Transaction> transaction = database.database()->Begin(testing::Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const absl::StatusOr<storage::JournalNow> now = storage::ReadJournalNow(*transaction);
  ASSERT_TRUE(now.ok()) << now.status();
  EXPECT_THAT(RecordKinds(), ::testing::UnorderedElementsAreArray(now->kinds));
}

}  // namespace
}  // namespace sixpoint::cli
