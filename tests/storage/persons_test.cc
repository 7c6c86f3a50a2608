// Persons in the record: by pseudonyms, whoever writes it, and no longer by name than the one table knows it.
#include "storage/persons.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "storage/blobs.h"
#include "storage/denials.h"
#include "storage/record.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::AsRole;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::Not;

class PersonsTest : public ::testing::Test {
 protected:
  absl::Status Append(const std::string& name, const std::string& requested_by, const std::string& trace_id = "") {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    if (!transaction.ok()) return transaction.status();
    RecordEntry entry;
    entry.kind = "scan";
    entry.name = name;
    entry.software_version = "0.1.0+test";
    entry.requested_by = requested_by;
    if (!trace_id.empty()) entry.trace_id = trace_id;
    if (const auto recorded = AppendRecord(*transaction, NewUuid(), entry); !recorded.ok()) return recorded.status();
    return transaction->Commit();
  }
  // As it lies there.
  std::string Kept(const std::string& sql) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    const absl::StatusOr<Rows> rows = transaction->Execute(sql);
    EXPECT_TRUE(rows.ok()) << rows.status();
    std::string kept;
    for (int row = 0; rows.ok() && row < rows->count(); ++row) kept += rows->Text(row, 0) + "\n";
    return kept;
  }
  JournalEntry Read(const std::string& name) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    const auto entry = FindEntry(*transaction, name);
    EXPECT_TRUE(entry.ok() && entry->has_value()) << entry.status();
    return entry.ok() && entry->has_value() ? **entry : JournalEntry();
  }
  absl::Status Forget(const std::string& user_name) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    if (absl::Status status = ForgetPerson(*transaction, user_name); !status.ok()) return status;
    return transaction->Commit();
  }
  ThrowawayDatabase database_;
};

TEST_F(PersonsTest, AreKeptUnderOnePseudonymAndReadByName) {
  ASSERT_TRUE(Append("scans/s1", "users/jane").ok());
  ASSERT_TRUE(Append("scans/s2", "users/jane via services/inspection").ok());
  ASSERT_TRUE(Append("scans/s3", "users/jane.doe").ok());
  ASSERT_TRUE(Append("scans/s4", "machines/m1").ok());
  EXPECT_EQ(Read("scans/s1").entry.requested_by, "users/jane");
  EXPECT_EQ(Read("scans/s2").entry.requested_by, "users/jane via services/inspection");
  EXPECT_EQ(Read("scans/s3").entry.requested_by, "users/jane.doe");
  EXPECT_EQ(Read("scans/s4").entry.requested_by, "machines/m1");
  const std::string jane =
      Kept("SELECT requested_by FROM record_entries e JOIN record_names USING (record_id) WHERE name = 'scans/s1'");
  EXPECT_THAT(jane, MatchesRegex("persons/[0-9a-f]{16}\n"));
  EXPECT_EQ(
      Kept("SELECT requested_by FROM record_entries e JOIN record_names USING (record_id) WHERE name = 'scans/s2'"),
      jane.substr(0, jane.size() - 1) + " via services/inspection\n");
  EXPECT_EQ(Kept("SELECT count(*) FROM persons"), "2\n");
}

TEST_F(PersonsTest, OnceForgottenStayPseudonymsAndComeBackAsOthers) {
  ASSERT_TRUE(Append("scans/s1", "users/jane").ok());
  const std::string was = Kept("SELECT requested_by FROM record_entries");
  ASSERT_TRUE(Forget("jane").ok());
  EXPECT_EQ(Read("scans/s1").entry.requested_by + "\n", was);
  ASSERT_TRUE(Append("scans/s2", "users/jane").ok());
  EXPECT_EQ(Read("scans/s2").entry.requested_by, "users/jane");
  EXPECT_EQ(Read("scans/s1").entry.requested_by + "\n", was);
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  const auto all = ListPersons(*transaction, {}, "", 10);
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_EQ(all->size(), 2u);
  int known = 0;
  for (const PersonRow& person : *all) {
    known += person.user_name.has_value();
    EXPECT_NE(person.user_name.has_value(), person.forgotten_at.has_value());
  }
  EXPECT_EQ(known, 1);
}

// Whoever writes it: binaries before this one, another table, a person with a client for SQL.
TEST_F(PersonsTest, NoAppendOnlyTableKeepsWhoAskedByName) {
  EXPECT_THAT(Kept("SELECT c.relname FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid "
                   "WHERE c.relkind IN ('r', 'p') AND c.relnamespace = 'public'::regnamespace "
                   "AND a.attname IN ('requested_by', 'caller', 'holder', 'subject') AND NOT a.attisdropped "
                   "AND EXISTS (SELECT 1 FROM pg_trigger t WHERE t.tgrelid = c.oid AND t.tgname = 'append_only') "
                   "AND c.relname NOT LIKE 'correction\\_checks%' "
                   "AND NOT EXISTS (SELECT 1 FROM pg_trigger t WHERE t.tgrelid = c.oid AND t.tgname = 'pseudonyms')"),
              IsEmpty());
  const auto plant = Database::Open(AsRole(database_.conninfo(), "plant"), 1);
  absl::StatusOr<Transaction> transaction = plant->Begin(Soon());
  // As a release before this one calls it.
  const auto before = transaction->Execute(
      "SELECT append_record('018f0000-0000-7000-8000-000000000001', 'scans/old', 'scan', NULL, NULL, '', '0.1.0', "
      "'users/jane', "
      "NULL, '{}', '{}', NULL, NULL, NULL)");
  // Its month has no partition, which is told only once the pseudonym is there.
  EXPECT_FALSE(before.ok());
  ASSERT_TRUE(Append("scans/s1", "users/jane").ok());
  Denial denial;
  denial.area = "plant";
  denial.method = "x/Y";
  denial.caller = "users/jane";
  denial.reason = "ROLE_MISSING";
  denial.sentence = "Y: users/jane is mes-reader, want admin";
  denial.count = 1;
  // Whose session it was is in the sentence alone, and who is not known is nobody's.
  Denial of_gateway = denial;
  of_gateway.caller = "services/gateway";
  of_gateway.sentence = "session: of users/jane, ended; users/mallory, too";
  Denial long_denial = denial;  // longer with the pseudonym than it may be
  for (int i = 0; i < 70; ++i) long_denial.sentence += " users/jane \xC3\xA9";
  absl::StatusOr<Transaction> denying = database_.database()->Begin(Soon());
  ASSERT_TRUE(AppendDenials(*denying, {denial, of_gateway, long_denial}).ok());
  ASSERT_TRUE(denying->Commit().ok());
  EXPECT_THAT(Kept("SELECT d::text FROM denials d"), Not(::testing::HasSubstr("jane")));
  EXPECT_THAT(Kept("SELECT sentence FROM denials WHERE caller = 'services/gateway'"),
              MatchesRegex("session: of persons/[0-9a-f]{16}, ended; users/\\*, too\n"));
  EXPECT_THAT(Kept("SELECT e::text FROM record_entries e"), Not(::testing::HasSubstr("jane")));
}

// Of two first calls of a person at once neither fails, and both are the same person's.
TEST_F(PersonsTest, SeenForTheFirstTimeTwiceAtOnceAreOne) {
  constexpr int kThreads = 6, kPersons = 20;
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&, thread] {
      const auto own = Database::Open(database_.conninfo(), 1);
      for (int person = 0; person < kPersons; ++person) {
        absl::StatusOr<Transaction> transaction = own->Begin(Soon());
        ASSERT_TRUE(transaction.ok()) << transaction.status();
        RecordEntry entry;
        entry.kind = "scan";
        entry.name = "scans/s" + std::to_string(thread) + "-" + std::to_string(person);
        entry.software_version = "0.1.0+test";
        entry.requested_by = "users/p" + std::to_string(person);
        const auto recorded = AppendRecord(*transaction, NewUuid(), entry);
        ASSERT_TRUE(recorded.ok()) << recorded.status();
        ASSERT_TRUE(transaction->Commit().ok());
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(Kept("SELECT count(*) FROM persons"), std::to_string(kPersons) + "\n");
  EXPECT_EQ(Kept("SELECT count(DISTINCT requested_by) FROM record_entries"), std::to_string(kPersons) + "\n");
}

TEST_F(PersonsTest, OnlyPlantForgets) {
  for (const char* area : {"ingest", "calibration", "registration", "correction", "inspection"}) {
    const auto other = Database::Open(AsRole(database_.conninfo(), area), 1);
    for (const char* sql :
         {"SELECT forget_person('jane')", "UPDATE persons SET user_name = NULL", "SELECT * FROM persons"}) {
      absl::StatusOr<Transaction> transaction = other->Begin(Soon());
      EXPECT_FALSE(transaction->Execute(sql).ok()) << area << ": " << sql;
    }
  }
  const auto plant = Database::Open(AsRole(database_.conninfo(), "plant"), 1);
  absl::StatusOr<Transaction> transaction = plant->Begin(Soon());
  EXPECT_TRUE(ForgetPerson(*transaction, "nobody").ok());
}

TEST_F(PersonsTest, AnEntryKnowsItsTrace) {
  const std::string trace_id = "0af7651916cd43dd8448eb211c80319c";
  ASSERT_TRUE(Append("scans/s1", "machines/m1", trace_id).ok());
  EXPECT_EQ(Read("scans/s1").entry.trace_id, trace_id);
  ASSERT_TRUE(Append("scans/s2", "machines/m1").ok());
  EXPECT_FALSE(Read("scans/s2").entry.trace_id.has_value());
  EXPECT_FALSE(Append("scans/s3", "machines/m1", "not one").ok());
}

}  // namespace
}  // namespace sixpoint::storage
