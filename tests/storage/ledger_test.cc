// The ledger: what is sealed, what is found of what a superuser of the database does to it, and what is no tampering.
#include "storage/ledger.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>

#include "ledger/audit.h"
#include "storage/ledger_check.h"
#include "storage/migrate.h"
#include "storage/persons.h"
#include "storage/record.h"
#include "storage/retention.h"
#include "tests/support/registered.h"
#include "tests/support/stored_scan.h"
#include "tests/support/tamperings.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::AddTamperedPlant;
using sixpoint::testing::AsRole;
using sixpoint::testing::Soon;
using sixpoint::testing::Tampering;
using sixpoint::testing::Tamperings;
using sixpoint::testing::ThrowawayDatabase;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

ledger::SigningKey NewKey() { return *ledger::SigningKey::OfPem(*ledger::SigningKey::NewPem()); }

template <typename Value>
Value Must(absl::StatusOr<Value> value) {
  if (!value.ok()) throw std::runtime_error(value.status().ToString());
  return *std::move(value);
}

// What a check says: "inspections/.. inspection_holes" and what the heads say.
struct Told {
  std::set<std::string> tables;
  std::vector<std::string> sentences;
  std::map<std::string, std::int64_t> not_here;
  std::int64_t unsealed = 0, leaves = 0;
};

Told CheckAll(Transaction& transaction, const std::vector<ledger::Head>& sent, const std::string& public_pem) {
  if (const absl::Status begun = BeginLedger(transaction); !begun.ok()) throw std::runtime_error(begun.ToString());
  ledger::Audit audit(sent, public_pem);
  Told told;
  std::vector<LedgerDamage> damages;
  const auto add = [&](const std::vector<LedgerDamage>& more) {
    damages.insert(damages.end(), more.begin(), more.end());
  };
  const LedgerEnd end = Must(ReadLedgerEnd(transaction));
  ledger::CompactRange range;
  std::int64_t last = kBeforeAll;
  constexpr std::int64_t kStep = 97;  // so that slices meet in the middle of things
  for (std::int64_t begin = 0; begin < end.size; begin += kStep) {
    const ledger::LeafSpan span{begin, std::min(begin + kStep, end.size)};
    for (const KeptHead& head : Must(ReadHeads(transaction, span.begin, span.end))) audit.AddHead(head.head);
    const LedgerSlice slice = Must(CheckSlice(transaction, span, last));
    std::vector<std::pair<int, ledger::Hash>> wanted, kept;
    for (const ledger::Hash& leaf : slice.leaf_hashes)
      range.Append(leaf, [&](int level, std::int64_t, const ledger::Hash& hash) {
        if (level >= kLeastKeptLevel) wanted.emplace_back(level, hash);
      });
    for (const LedgerNode& node : Must(ReadNodes(transaction, span))) kept.emplace_back(node.level, node.hash);
    if (wanted != kept) damages.push_back({DamageKind::kChanged, "ledger_nodes", "", "", 0, ""});
    audit.AddLeaves(slice.leaf_hashes);
    add(slice.damages);
    for (const auto& [month, count] : slice.not_here) told.not_here[month] += count;
    last = slice.last_sequence;
  }
  audit.Finish();
  add(Must(CheckTablesArePlain(transaction)));
  for (std::size_t i = 0; i < LedgerTables().size(); ++i) add(Must(CheckOrphans(transaction, i)));
  add(Must(CheckBlobsAreThere(transaction)));
  for (BlobSlice blobs = Must(CheckBlobSlice(transaction, "", 100)); blobs.count > 0;
       blobs = Must(CheckBlobSlice(transaction, blobs.last_sha256, 100)))
    add(blobs.damages);
  for (const LedgerDamage& damage : damages) {
    told.tables.insert(damage.table);
    told.sentences.push_back(damage.table + ": " + damage.name + " " + damage.detail);
  }
  for (const ledger::Finding& finding : audit.findings()) {
    told.tables.insert("heads");
    told.sentences.push_back(finding.sentence);
  }
  told.unsealed = Must(CountUnsealed(transaction, last));
  told.leaves = end.size;
  return told;
}

class LedgerTest : public ::testing::Test {
 protected:
  Transaction Begin() { return Must(database_.database()->Begin(Soon(60))); }
  void Do(const std::string& sql) {
    Transaction transaction = Begin();
    const absl::Status done = transaction.Execute(sql).status();
    ASSERT_TRUE(done.ok()) << sql << ": " << done;
    ASSERT_TRUE(transaction.Commit().ok());
  }
  void Seal() {
    Transaction transaction = Begin();
    ASSERT_TRUE(BeginLedger(transaction).ok());
    Must(SealEntries(transaction, 1000));
    ASSERT_TRUE(transaction.Commit().ok());
  }
  Told Check(const std::vector<ledger::Head>& sent = {}) {
    Transaction transaction = Begin();
    return CheckAll(transaction, sent, sent.empty() ? "" : key_.public_pem());
  }
  ThrowawayDatabase database_;
  const ledger::SigningKey key_ = NewKey();
};

TEST_F(LedgerTest, EveryKindOfTamperingIsFoundAndNamed) {
  const std::vector<ledger::Head> sent = AddTamperedPlant(database_.database(), key_, 30);
  ASSERT_THAT(sent, SizeIs(2));
  ASSERT_GT(sent[0].tree_size, 256) << "want kept subtrees, too";
  {
    const Told untouched = Check(sent);
    ASSERT_THAT(untouched.sentences, IsEmpty());
    EXPECT_EQ(untouched.leaves, sent[1].tree_size);
  }
  ASSERT_GE(Tamperings().size(), 20u);
  for (const Tampering& tampering : Tamperings()) {
    Transaction transaction = Begin();
    const absl::Status done = sixpoint::testing::Tamper(transaction, tampering);
    ASSERT_TRUE(done.ok()) << tampering.what << ": " << done;
    try {
      const Told told = CheckAll(transaction, sent, key_.public_pem());
      EXPECT_THAT(told.tables, Contains(tampering.table))
          << tampering.what << ": " << ::testing::PrintToString(told.sentences);
      EXPECT_LE(told.sentences.size(), 600u) << tampering.what;
    } catch (const std::runtime_error& error) {
      ADD_FAILURE() << tampering.what << ": " << error.what();
    }
  }
  EXPECT_THAT(Check(sent).sentences, IsEmpty()) << "each was rolled back";
}

// Without the heads that were sent out a ledger that is made anew is as good as the old one: that is what they are for.
TEST_F(LedgerTest, OnlyHeadsThatWereSentOutTellOfALedgerMadeAnew) {
  const std::vector<ledger::Head> sent = AddTamperedPlant(database_.database(), key_, 2);
  for (const Tampering& tampering : Tamperings()) {
    if (tampering.reseal != sixpoint::testing::Reseal::kAnotherKey) continue;
    Transaction transaction = Begin();
    ASSERT_TRUE(sixpoint::testing::Tamper(transaction, tampering).ok());
    EXPECT_THAT(CheckAll(transaction, {}, "").sentences, IsEmpty());
  }
}

TEST_F(LedgerTest, WhatIsNewIsNotSealedYetAndNoTampering) {
  const std::vector<ledger::Head> sent = AddTamperedPlant(database_.database(), key_, 2);
  sixpoint::testing::RecordName(database_.database(), "scan", "scans/new");
  const Told told = Check(sent);
  EXPECT_THAT(told.sentences, IsEmpty());
  EXPECT_EQ(told.unsealed, 1);
  Seal();
  EXPECT_EQ(Check(sent).unsealed, 0);
  EXPECT_EQ(Check(sent).leaves, sent[1].tree_size + 1);
}

TEST_F(LedgerTest, ThePlantsRoleSealsAndChecksAndAnotherDoesNot) {
  sixpoint::testing::RegisterUsual(database_.database());
  const auto as = [&](const char* area) { return Database::Open(AsRole(database_.conninfo(), area), 1); };
  {
    const auto plant = as("plant");
    Transaction transaction = Must(plant->Begin(Soon()));
    EXPECT_FALSE(transaction.Execute("SELECT 1 FROM public.registrations").ok()) << "its own rights are as they were";
  }
  const auto plant = as("plant");
  Transaction transaction = Must(plant->Begin(Soon()));
  ASSERT_TRUE(BeginLedger(transaction).ok());
  EXPECT_GT(Must(SealEntries(transaction, 1000)).count, 0);
  EXPECT_THAT(CheckAll(transaction, {}, "").sentences, IsEmpty());
  EXPECT_TRUE(transaction.Commit().ok());
  const auto ingest = as("ingest");
  Transaction refused = Must(ingest->Begin(Soon()));
  EXPECT_FALSE(BeginLedger(refused).ok());
}

TEST_F(LedgerTest, TwoSealersTakeTurns) {
  sixpoint::testing::RegisterUsual(database_.database());
  Transaction first = Begin(), second = Begin();
  ASSERT_TRUE(BeginLedger(first).ok() && BeginLedger(second).ok());
  const std::int64_t count = Must(SealEntries(first, 1000)).count;
  EXPECT_GT(count, 0);
  EXPECT_EQ(Must(SealEntries(second, 1000)).count, 0);
  ASSERT_TRUE(first.Commit().ok());
  EXPECT_EQ(Check().leaves, count);
}

TEST_F(LedgerTest, RootsAndPathsComeFromKeptSubtrees) {
  for (int i = 0; i < 12; ++i) {
    Do("SELECT count(append_record(id, 'scans/s" + std::to_string(i) +
       "-' || g, 'scan', NULL, NULL, '', 'test', 'test', NULL, '{}', '{}', NULL, NULL, NULL)) FROM (SELECT g, "
       "(substr(least_uuid_of(now())::text, 1, 15) || '7' || substr(gen_random_uuid()::text, 17))::uuid AS id FROM "
       "generate_series(1, 50) g) made");
    Seal();
  }
  Transaction transaction = Begin();
  ASSERT_TRUE(BeginLedger(transaction).ok());
  const std::int64_t size = Must(ReadLedgerEnd(transaction)).size;
  ASSERT_EQ(size, 600);
  std::vector<ledger::Hash> leaves;
  ledger::CompactRange range;
  for (const ledger::Leaf& leaf : Must(ReadLeaves(transaction, {0, size}))) {
    leaves.push_back(ledger::LeafHash(LeafText(leaf)));
    range.Append(leaves.back());
    if (range.size() % 37 == 0) {
      EXPECT_EQ(Must(RootOf(transaction, {0, range.size()})), range.Root());
    }
  }
  for (const std::int64_t index : {0, 1, 255, 256, 511, 512, 599})
    EXPECT_TRUE(ledger::PathProves(leaves[static_cast<std::size_t>(index)], index, size,
                                   Must(PathOf(transaction, index, size)), range.Root()))
        << index;
  EXPECT_EQ(RootOf(transaction, {0, 601}).status().code(), absl::StatusCode::kOutOfRange);
}

// What a row is as text depends on nothing but its values.
TEST_F(LedgerTest, ARowsTextDependsOnItsValuesOnly) {
  Do("CREATE TABLE odd (b bytea, a double precision, \"C\" real[], t timestamptz, d text, n integer, j jsonb, u "
     "boolean)");
  Do("INSERT INTO odd VALUES ('\\x00ff', 0.1, '{0.1,-0,1e-30}', '2026-07-01 12:00:00.000001+02', E'a\"\\\\\\n\\u00e9', "
     "NULL, "
     "'{\"b\": null, \"a\": 1.50}', true)");
  const auto text = [&](const std::string& settings) {
    Transaction transaction = Begin();
    if (!settings.empty()) Must(transaction.Execute(settings));
    EXPECT_TRUE(transaction.Execute("GRANT SELECT ON odd TO sixpoint_ledger").ok());
    EXPECT_TRUE(BeginLedger(transaction).ok());
    const Rows columns =
        Must(transaction.Execute("SELECT attname FROM pg_attribute WHERE attrelid = 'public.odd'::regclass AND attnum "
                                 "> 0 ORDER BY attname COLLATE \"C\""));
    std::vector<std::string> names;
    for (int row = 0; row < columns.count(); ++row) names.push_back(columns.Text(row, 0));
    return Must(transaction.Execute("SELECT " + RowTextSql(names) + " FROM public.odd t")).Text(0, 0);
  };
  EXPECT_EQ(text(""),
            "{\"C\":\"{0.1,-0,1e-30}\",\"a\":\"0.1\",\"b\":\"\\\\x00ff\",\"d\":\"a\\\"\\\\\\n\xc3\xa9\",\"j\":\"{"
            "\\\"a\\\": 1.50, "
            "\\\"b\\\": null}\",\"t\":\"2026-07-01 10:00:00.000001+00\",\"u\":\"true\"}");
  const std::string before = text("");
  EXPECT_EQ(text("SELECT set_config('timezone', 'Asia/Tokyo', true), set_config('datestyle', 'German', true), "
                 "set_config('bytea_output', 'escape', true), set_config('extra_float_digits', '-15', true), "
                 "set_config('intervalstyle', 'iso_8601', true)"),
            before);
  Do("ALTER TABLE odd ADD COLUMN later double precision");
  EXPECT_EQ(text(""), before);
  Do("ALTER TABLE odd DISABLE TRIGGER ALL");
  Do("UPDATE odd SET later = 0");
  EXPECT_NE(text(""), before) << "a later column of an old row is part of it";
  Do("UPDATE odd SET later = NULL, a = 0.10000000000000002");
  EXPECT_NE(text(""), before) << "one bit";
}

// The next migration cannot forget a table: each that is append-only is in the ledger, or said here to have no place in it.
TEST_F(LedgerTest, EveryTableOfTheRecordIsInTheLedger) {
  // The leaf itself has the digest of record_names; of machines, artefacts, parts and machining models, ids alone, the revisions are in it; requests are
  // dropped after months; blobs and plant_identity are the store's, whose digests stand in the rows that refer to them; drifts follow
  // from the calibrations; the others are not of the journal.
  std::set<std::string> without;
  std::istringstream words(
      "record_names machines artefacts parts machining_models drawings requests blobs blob_damages plant_identity "
      "calibration_drifts denials "
      "account_events clearance_events webhooks webhook_withdrawals ledger_leaves ledger_contents ledger_nodes "
      "ledger_heads");
  for (std::string word; words >> word;) without.insert(word);
  std::set<std::string> known = without;
  for (const LedgerTable& table : LedgerTables()) EXPECT_TRUE(known.insert(table.name).second) << table.name;
  Transaction transaction = Begin();
  const Rows tables =
      Must(transaction.Execute("SELECT c.relname, has_table_privilege('sixpoint_ledger', c.oid, 'SELECT') FROM "
                               "pg_class c WHERE c.relnamespace = "
                               "'public'::regnamespace AND c.relkind IN ('r', 'p') AND NOT c.relispartition AND EXISTS "
                               "(SELECT 1 FROM pg_trigger t WHERE "
                               "t.tgrelid = c.oid AND t.tgname = 'append_only')"));
  std::set<std::string> found;
  for (int row = 0; row < tables.count(); ++row) {
    const std::string name = tables.Text(row, 0);
    EXPECT_THAT(known, Contains(name)) << "want it in storage/ledger_rows.cc, by what it hangs on its entry";
    EXPECT_TRUE(without.count(name) > 0 || tables.Bool(row, 1)) << name << ": want SELECT for sixpoint_ledger";
    found.insert(name);
  }
  EXPECT_EQ(found, known);
  const Rows partitioned = Must(transaction.Execute("SELECT name FROM partitioned_tables"));
  std::set<std::string> by_months;
  for (int row = 0; row < partitioned.count(); ++row) by_months.insert(partitioned.Text(row, 0));
  for (const LedgerTable& table : LedgerTables()) EXPECT_EQ(IsByMonths(table.name), by_months.count(table.name) > 0);
}

// Rows that were sealed before a column came must have the same text after it: it is NULL in them.
TEST_F(LedgerTest, ColumnsThatCameAfterTheLedgerMayBeNull) {
  namespace fs = std::filesystem;
  const fs::path then = fs::temp_directory_path() / ("sixpoint-migrations-" + NewUuid());
  fs::create_directory(then);
  for (const auto& file : fs::directory_iterator(ThrowawayDatabase::MigrationsFolder()))
    if (file.path().extension() == ".sql" && file.path().filename().string() < "V0027") fs::copy(file.path(), then);
  ThrowawayDatabase old(ThrowawayDatabase::Schema::kEmpty);
  const absl::StatusOr<int> migrated = Migrate(old.conninfo(), then.string());
  fs::remove_all(then);
  ASSERT_TRUE(migrated.ok()) << migrated.status();
  const auto needed = [](Database* database) {
    Transaction transaction = Must(database->Begin(Soon()));
    const Rows rows =
        Must(transaction.Execute("SELECT c.relname, a.attname, a.attnotnull FROM pg_class c JOIN pg_attribute a ON "
                                 "a.attrelid = c.oid WHERE c.relnamespace = "
                                 "'public'::regnamespace AND c.relkind IN ('r', 'p') AND NOT c.relispartition AND "
                                 "a.attnum > 0 AND NOT a.attisdropped"));
    std::map<std::string, std::set<std::string>> columns;
    for (int row = 0; row < rows.count(); ++row)
      if (rows.Bool(row, 2)) columns[rows.Text(row, 0)].insert(rows.Text(row, 1));
    return columns;
  };
  const auto before = needed(old.database()), now = needed(database_.database());
  for (const LedgerTable& table : LedgerTables()) {
    const auto was = before.find(table.name);
    if (was == before.end()) continue;
    // One that may be NULL now and had a value then has it still.
    const std::set<std::string>& is = now.at(table.name);
    EXPECT_TRUE(std::includes(was->second.begin(), was->second.end(), is.begin(), is.end())) << table.name;
  }
}

class LegalTest : public LedgerTest {};

TEST_F(LegalTest, RetentionDeletesPointsAndIsNoTampering) {
  const std::unique_ptr<BlobStore> store = MakePostgresqlBlobStore();
  sixpoint::testing::PutScanSubjects(database_.database());
  sixpoint::testing::PutScan(database_.database(), store.get(), "old", "artefact", {"old points"}, 0);
  Seal();
  ASSERT_THAT(Check().sentences, IsEmpty());
  DeletionOrder order;
  order.scan_id = "old";
  order.reason = "too old";
  order.requested_by = order.software_version = "test";
  const auto deleted = DeleteScanPoints(database_.database(), nullptr, order, Soon(60));
  ASSERT_TRUE(deleted.ok()) << deleted.status();
  ASSERT_GT(deleted->freed_count, 0);
  EXPECT_THAT(Check().sentences, IsEmpty());
  EXPECT_EQ(Check().unsealed, 1);
  Seal();
  EXPECT_THAT(Check().sentences, IsEmpty());
  EXPECT_EQ(Check().unsealed, 0);
}

TEST_F(LegalTest, AForgottenPersonIsNoTampering) {
  Transaction transaction = Begin();
  RecordEntry entry;
  entry.kind = "scan";
  entry.name = "scans/hers";
  entry.software_version = "test";
  entry.requested_by = "users/jane";
  Must(AppendRecord(transaction, NewUuid(), entry));
  ASSERT_TRUE(transaction.Commit().ok());
  Seal();
  Transaction forget = Begin();
  ASSERT_TRUE(ForgetPerson(forget, "jane").ok());
  ASSERT_TRUE(forget.Commit().ok());
  EXPECT_THAT(Check().sentences, IsEmpty());
}

TEST_F(LegalTest, ADetachedMonthIsNotHereAndNoTampering) {
  Do("SELECT make_partition(held_by, name, by_uuid, '2026-03-01') FROM partitioned_tables ORDER BY depth, name");
  for (const auto& [id, name] : {std::pair("019cbb4b-4c00-7000-8000-000000000001", "scans/march"),
                                 std::pair("019cbb4b-4c00-7000-8000-000000000002", "scans/march-too")}) {
    Transaction transaction = Begin();
    RecordEntry entry;
    entry.kind = "scan";
    entry.name = name;
    entry.software_version = "test";
    Must(AppendRecord(transaction, id, entry));
    ASSERT_TRUE(transaction.Commit().ok());
  }
  sixpoint::testing::RecordName(database_.database(), "scan", "scans/now");
  Do("INSERT INTO retention_policies (scan_kind, revision, keep_days, requested_by, record_id) VALUES ('pins', 1, 30, "
     "'test', '019cbb4b-4c00-7000-8000-000000000002')");
  Seal();
  ASSERT_EQ(MonthOf("019cbb4b-4c00-7000-8000-000000000001"), "2026_03");
  ASSERT_THAT(Check().not_here, IsEmpty());
  Do("SELECT detach_month('2026-03-01')");
  Told told = Check();
  EXPECT_THAT(told.sentences, IsEmpty());
  EXPECT_THAT(told.not_here, ElementsAre(std::pair("2026_03", 2)));
  Do("ALTER TABLE record_names DISABLE TRIGGER USER");
  Do("UPDATE record_names SET name = 'scans/april' WHERE name = 'scans/march'");
  EXPECT_THAT(Check().tables, ElementsAre("record_names")) << "its name stays, and is proven";
  Do("ALTER TABLE retention_policies DISABLE TRIGGER USER");
  Do("DELETE FROM retention_policies");
  EXPECT_THAT(Check().tables, ElementsAre("record_names", "retention_policies"))
      << "tables that are not by months stay";
}

}  // namespace
}  // namespace sixpoint::storage
