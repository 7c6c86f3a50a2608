#include "storage/months.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ctime>

#include "storage/blob_collector.h"
#include "storage/blob_store.h"
#include "storage/record.h"
#include "tests/support/stored_scan.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::PutScan;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using ::testing::HasSubstr;

// "2026-11-01": the first day of the month so many months from now, by UTC.
std::string FirstDay(int months_from_now) {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  gmtime_r(&now, &utc);
  const int months = utc.tm_year * 12 + utc.tm_mon + months_from_now;
  char text[32];
  std::snprintf(text, sizeof text, "%04d-%02d-01", 1900 + months / 12, 1 + months % 12);
  return text;
}

class MonthsTest : public ::testing::Test {
 protected:
  absl::StatusOr<Rows> Try(const std::string& sql) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon(60));
    if (!transaction.ok()) return transaction.status();
    absl::StatusOr<Rows> rows = transaction->Execute(sql);
    if (!rows.ok()) return rows;
    if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
    return rows;
  }
  Rows Run(const std::string& sql) {
    const absl::StatusOr<Rows> rows = Try(sql);
    EXPECT_TRUE(rows.ok()) << sql << ": " << rows.status();
    return rows.ok() ? *rows : Rows();
  }
  std::vector<MonthUse> Months() {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    const auto months = ListMonths(*transaction);
    EXPECT_TRUE(months.ok()) << months.status();
    return months.ok() ? *months : std::vector<MonthUse>();
  }
  absl::StatusOr<int> Make(int months_ahead) { return MakeMonths(*database_.database(), months_ahead, Soon(60)); }
  absl::StatusOr<Recorded> Append(const std::string& record_id, const std::string& name,
                                  const std::vector<std::string>& inputs = {}) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    RecordEntry entry;
    entry.kind = "scan";
    entry.name = name;
    entry.inputs = inputs;
    entry.software_version = "test";
    absl::StatusOr<Recorded> recorded = AppendRecord(*transaction, record_id, entry);
    if (!recorded.ok()) return recorded;
    if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
    return recorded;
  }
  // The least id of the month so many months ago, whose partitions it makes.
  std::string IdOfOldMonth(int months_ago) {
    const std::string day = FirstDay(-months_ago);
    Run("SELECT make_partition(held_by, name, by_uuid, '" + day + "') FROM partitioned_tables ORDER BY depth, name");
    return Run("SELECT least_uuid_of('" + day + "')").Text(0, 0);
  }

  ThrowawayDatabase database_;
};

TEST_F(MonthsTest, ThisMonthAndThreeAheadAreThereAndMoreAreMadeOnce) {
  ASSERT_EQ(Months().size(), 4u);
  EXPECT_EQ(Months().front().month, FirstDay(0).substr(0, 7));
  EXPECT_EQ(Months().back().month, FirstDay(3).substr(0, 7));
  const int tables = Months().front().partition_count;
  EXPECT_GT(tables, 15);
  EXPECT_GT(Months().front().bytes, 0);
  EXPECT_EQ(*Make(3), 0);
  EXPECT_EQ(*Make(5), 2 * tables);
  EXPECT_EQ(*Make(5), 0);
  EXPECT_EQ(Months().size(), 6u);
  for (const int wrong : {-1, 121}) EXPECT_EQ(Make(wrong).status().code(), absl::StatusCode::kInvalidArgument) << wrong;
}

TEST_F(MonthsTest, MonthsAreMadeBesideReadersAndAfterWriters) {
  absl::StatusOr<Transaction> reader = database_.database()->Begin(Soon(60));
  ASSERT_TRUE(reader->Execute("SELECT count(*) FROM registrations, corrections, inspections, record_names").ok());
  const auto beside = Make(4);
  EXPECT_TRUE(beside.ok()) << beside.status();
  EXPECT_TRUE(reader->Execute("SELECT count(*) FROM record_entries").ok());

  absl::StatusOr<Transaction> writer = database_.database()->Begin(Soon(60));
  RecordEntry entry;
  entry.kind = "scan";
  entry.name = "scans/s1";
  entry.software_version = "test";
  ASSERT_TRUE(AppendRecord(*writer, NewUuid(), entry).ok());
  EXPECT_EQ(Make(5).status().code(), absl::StatusCode::kUnavailable);  // and does not wait for ever
  ASSERT_TRUE(writer->Commit().ok());
  const auto after = Make(5);
  EXPECT_TRUE(after.ok()) << after.status();
}

// By the database's own words, for every table that is kept by months: a query for one result looks at one partition.
TEST_F(MonthsTest, AResultIsLookedForInItsMonthAlone) {
  const Rows tables =
      Run("SELECT name, (SELECT a.attname FROM pg_attribute a JOIN pg_partitioned_table p ON p.partrelid = a.attrelid "
          "WHERE a.attrelid = held_by AND a.attnum = p.partattrs[0]) FROM partitioned_tables WHERE by_uuid");
  EXPECT_GT(tables.count(), 10);
  for (int row = 0; row < tables.count(); ++row) {
    const std::string table = tables.Text(row, 0);
    const Rows plan =
        Run("EXPLAIN SELECT * FROM " + table + " WHERE " + tables.Text(row, 1) + " = '" + NewUuid() + "'");
    std::string text;
    for (int line = 0; line < plan.count(); ++line) text += plan.Text(line, 0) + "\n";
    EXPECT_THAT(text, HasSubstr(table + FirstDay(0).replace(4, 1, "_").substr(0, 7).insert(0, "_"))) << text;
    EXPECT_THAT(text, ::testing::Not(HasSubstr("Append"))) << text;
  }
}

TEST_F(MonthsTest, WhatComesWithAnIdOfAnotherTimeIsRefused) {
  EXPECT_EQ(Append("0000eb90-0000-7000-8000-000000000000", "scans/old").status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST_F(MonthsTest, AMonthLeavesWholeAndItsNamesStay) {
  const std::string old_id = IdOfOldMonth(3);
  const auto old = Append(old_id, "scans/old");
  ASSERT_TRUE(old.ok()) << old.status();
  ASSERT_TRUE(Append(NewUuid(), "scans/new", {"scans/old"}).ok());
  EXPECT_EQ(Run("SELECT detach_month('" + FirstDay(-3) + "')").Int(0, 0), Months().front().partition_count);
  EXPECT_EQ(Months().size(), 4u);

  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  EXPECT_FALSE(FindEntry(*transaction, "scans/old")->has_value());
  EXPECT_TRUE(*IsRecorded(*transaction, "scans/old"));
  // What was made from it goes on saying so, and recall from it goes on.
  EXPECT_THAT((**FindEntry(*transaction, "scans/new")).entry.inputs, ::testing::ElementsAre("scans/old"));
  EXPECT_EQ(DerivedFrom(*transaction, "scans/old")->size(), 1u);
  EXPECT_EQ(Append(NewUuid(), "scans/old").status().code(), absl::StatusCode::kAlreadyExists);  // given once for ever
  const std::string table = "detached.record_entries_" + FirstDay(-3).replace(4, 1, "_").substr(0, 7);
  EXPECT_EQ(Run("SELECT count(*) FROM " + table).Int(0, 0), 1);
  EXPECT_FALSE(Try("DELETE FROM " + table).ok());  // append-only as before
}

// A month with rows that refer to each other, and a blob that only it refers to.
TEST_F(MonthsTest, ADetachedMonthKeepsItsBlobs) {
  const std::unique_ptr<BlobStore> store = MakePostgresqlBlobStore();
  sixpoint::testing::PutScanSubjects(database_.database());
  PutScan(database_.database(), store.get(), "new", "artefact", {"new points"}, 0);
  const std::string old_blob = sixpoint::testing::PutCloud(database_.database(), store.get(), "old points");
  // The new scan once more, of three months ago.
  const std::string old_id = IdOfOldMonth(3);
  ASSERT_TRUE(Append(old_id, "scans/old").ok());
  Run("CREATE TABLE copied AS SELECT * FROM scans");
  Run("UPDATE copied SET scan_key = '" + old_id + "', scan_id = 'old'");
  Run("INSERT INTO scans SELECT * FROM copied");
  Run("INSERT INTO scan_blocks SELECT '" + old_id + "', 0, 1, '\\x" + old_blob + "', 0, 1, sha256('sent')");
  ASSERT_GT(Run("SELECT detach_month('" + FirstDay(-3) + "')").Int(0, 0), 0);
  EXPECT_EQ(Run("SELECT count(*) FROM scans").Int(0, 0), 1);
  CollectOptions everything;
  everything.grace = std::chrono::seconds(0);
  const auto as_ingest = Database::Open(sixpoint::testing::AsRole(database_.conninfo(), "ingest"), 2);
  const auto collected = CollectGarbage(as_ingest.get(), nullptr, everything, Soon(60));
  ASSERT_TRUE(collected.ok()) << collected.status();
  EXPECT_EQ(collected->blob_count, 0);
  Run("DROP TABLE detached.scan_blocks_" + FirstDay(-3).replace(4, 1, "_").substr(0, 7));
  EXPECT_EQ(CollectGarbage(database_.database(), nullptr, everything, Soon(60))->blob_count, 1);
}

TEST_F(MonthsTest, OnlyAMonthThatIsOverForAMonthIsDetached) {
  for (const std::string& month : {FirstDay(0), FirstDay(-1), FirstDay(1), std::string("2020-01-15")})
    EXPECT_EQ(Try("SELECT detach_month('" + month + "')").status().code(), absl::StatusCode::kInvalidArgument) << month;
}

TEST_F(MonthsTest, OldRequestsGoAndWhatTheyRecordedStays) {
  Run("SELECT make_partition(held_by, name, by_uuid, '" + FirstDay(-5) +
      "') FROM partitioned_tables WHERE name = 'requests'");
  ASSERT_TRUE(Append(NewUuid(), "scans/s1").ok());
  Run("INSERT INTO requests SELECT '" + FirstDay(-5) +
      "'::timestamptz, 'ingest.Call', gen_random_uuid(), sha256('request'), record_id FROM record_names");
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  EXPECT_EQ(*ForgetRequests(*transaction), 1);
  ASSERT_TRUE(transaction->Commit().ok());
  EXPECT_EQ(Run("SELECT count(*) FROM requests").Int(0, 0), 0);
  EXPECT_EQ(Run("SELECT count(*) FROM record_entries").Int(0, 0), 1);
  EXPECT_EQ(Try("SELECT drop_requests_before('" + FirstDay(0) + "')").status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace sixpoint::storage
