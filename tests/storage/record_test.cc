#include "storage/record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "storage/blobs.h"
#include "storage/plant_registry.h"
#include "storage/scans.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using ::testing::ElementsAre;

RecordEntry Entry(const std::string& kind, const std::string& name, const std::vector<std::string>& inputs,
                  std::optional<std::string> blade = std::nullopt) {
  RecordEntry entry;
  entry.kind = kind;
  entry.name = name;
  entry.inputs = inputs;
  entry.blade = std::move(blade);
  entry.software_version = "0.1.0+test";
  return entry;
}

std::vector<std::string> NamesOf(const absl::StatusOr<std::vector<JournalEntry>>& entries) {
  EXPECT_TRUE(entries.ok()) << entries.status();
  std::vector<std::string> names;
  for (const JournalEntry& journal : *entries) names.push_back(journal.entry.name);
  return names;
}

class RecordTest : public ::testing::Test {
 protected:
  // What it was made from is recorded before, unless it is.
  void Append(const RecordEntry& entry) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    ASSERT_TRUE(transaction.ok()) << transaction.status();
    for (const std::string& input : entry.inputs) {
      if (*IsRecorded(*transaction, input)) continue;
      const absl::StatusOr<Recorded> made = AppendRecord(*transaction, NewUuid(), Entry("scan", input, {}));
      ASSERT_TRUE(made.ok()) << made.status();
    }
    const absl::StatusOr<Recorded> recorded = AppendRecord(*transaction, NewUuid(), entry);
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }
  ThrowawayDatabase database_;
};

TEST_F(RecordTest, AnEntryComesBackWhole) {
  RecordEntry entry = Entry("scan", "scans/s1", {"machines/m1@2", "blades/b1", "machines/m1@2"}, "b1");
  entry.machine = "m1";
  entry.method = "line";
  entry.requested_by = "operator";
  entry.measured_at = Instant(std::chrono::microseconds(1795231646123456));
  entry.summary_json = R"({"point_count": 12})";
  const Instant before = std::chrono::time_point_cast<std::chrono::microseconds>(std::chrono::system_clock::now());
  Append(entry);
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  const absl::StatusOr<std::vector<JournalEntry>> found = RecordOfBlade(*transaction, "b1");
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_EQ(found->size(), 1u);
  const JournalEntry& back = found->front();
  EXPECT_EQ(back.entry.kind, entry.kind);
  EXPECT_EQ(back.entry.name, entry.name);
  EXPECT_THAT(back.entry.inputs, ElementsAre("machines/m1@2", "blades/b1"));
  EXPECT_EQ(back.entry.blade, entry.blade);
  EXPECT_EQ(back.entry.machine, entry.machine);
  EXPECT_EQ(back.entry.method, entry.method);
  EXPECT_EQ(back.entry.software_version, entry.software_version);
  EXPECT_EQ(back.entry.requested_by, entry.requested_by);
  EXPECT_EQ(back.entry.measured_at, entry.measured_at);
  EXPECT_EQ(back.entry.summary_json, entry.summary_json);
  EXPECT_GE(back.recorded.recorded_at, before);
  EXPECT_GT(back.recorded.sequence, 0);
}

TEST_F(RecordTest, RecallFindsEverythingThatRestsOnACalibration) {
  Append(Entry("calibration", "calibrations/c1", {"machines/m1@1"}));
  Append(Entry("calibration", "calibrations/c2", {"machines/m1@2"}));
  Append(Entry("registration", "registrations/r1", {"scans/s1", "calibrations/c1"}, "b1"));
  Append(Entry("registration", "registrations/r2", {"scans/s2", "calibrations/c2"}, "b2"));
  Append(Entry("correction", "corrections/k1", {"registrations/r1", "calibrations/c1"}, "b1"));
  Append(Entry("inspection", "inspections/i1", {"corrections/k1"}, "b1"));
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "calibrations/c1")),
              ElementsAre("registrations/r1", "corrections/k1", "inspections/i1"));
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "inspections/i1")), ElementsAre());
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "machines/m1@2")), ElementsAre("calibrations/c2", "registrations/r2"));
  // Without a revision: all of them.
  EXPECT_EQ(DerivedFrom(*transaction, "machines/m1")->size(), 6u);
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "machines/m")), ElementsAre());
  EXPECT_THAT(NamesOf(RecordOfBlade(*transaction, "b1")),
              ElementsAre("registrations/r1", "corrections/k1", "inspections/i1"));
}

TEST_F(RecordTest, RecallAndRecordsComeByPagesAndKinds) {
  Append(Entry("calibration", "calibrations/a1", {"machines/m1@1"}));
  Append(Entry("calibration", "calibrations/c1", {"machines/m1@1", "calibrations/a1"}));
  for (const std::string id : {"1", "2", "3"}) {
    Append(Entry("registration", "registrations/r" + id, {"scans/s" + id, "calibrations/c1"}, "b1"));
    Append(Entry("correction", "corrections/k" + id, {"registrations/r" + id}, "b1"));
  }
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  // Results that rest on an axis table rest on it through the calibration that was made with it.
  const auto all = DerivedFrom(*transaction, "calibrations/a1");
  ASSERT_EQ(all->size(), 7u);
  std::vector<std::string> paged;
  JournalPage page{0, 2};
  for (;;) {
    const auto entries = DerivedFrom(*transaction, "calibrations/a1", {}, page);
    ASSERT_TRUE(entries.ok()) << entries.status();
    for (const JournalEntry& journal : *entries) paged.push_back(journal.entry.name);
    if (entries->size() < 2) break;
    page.after_sequence = entries->back().recorded.sequence;
  }
  EXPECT_EQ(paged, NamesOf(all));
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "calibrations/a1", {"correction", "calibration"})),
              ElementsAre("calibrations/c1", "corrections/k1", "corrections/k2", "corrections/k3"));
  EXPECT_THAT(NamesOf(RecordOfBlade(*transaction, "b1", {}, {all->at(1).recorded.sequence, 2})),
              ElementsAre("corrections/k1", "registrations/r2"));
  EXPECT_THAT(NamesOf(RecordOfBlade(*transaction, "b1", {"registration"}, {all->at(1).recorded.sequence, 2})),
              ElementsAre("registrations/r2", "registrations/r3"));
}

TEST_F(RecordTest, RecallFromAnArtefactsScanGoesThroughItsCalibration) {
  Append(Entry("scan", "scans/plate", {"machines/m1@1", "artefacts/a1@1"}));
  Append(Entry("calibration", "calibrations/c1", {"machines/m1@1", "scans/plate"}));
  Append(Entry("study", "studies/s1", {"scans/plate"}));
  Append(Entry("registration", "registrations/r1", {"scans/s1", "calibrations/c1"}, "b1"));
  Append(Entry("withdrawal", "withdrawals/w1", {"calibrations/c1"}));
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "scans/plate")),
              ElementsAre("calibrations/c1", "studies/s1", "registrations/r1", "withdrawals/w1"));
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "artefacts/a1")),
              ElementsAre("scans/plate", "calibrations/c1", "studies/s1", "registrations/r1", "withdrawals/w1"));
}

// What a scan was made with is what it states, or else what its machine's record does; the probe goes with the machine's record.
TEST_F(RecordTest, RecallByTheScannerAndTheTouchProbe) {
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  MachineRow machine = sixpoint::testing::MachineOf("m1");
  machine.sensor_serial_number = "LJ 0815/a";
  machine.touch_probe_serial_number = "TP-1";
  ASSERT_TRUE(InsertMachine(*transaction, machine, Entry("", "", {})).ok());
  sixpoint::testing::RegisterPart(*transaction, "vane");
  sixpoint::testing::RegisterBlade(*transaction, "b1", "vane");
  for (const std::string id : {"s1", "s2"}) {
    ScanRow scan;
    scan.scan_id = id;
    scan.machine_id = "m1";
    scan.machine_revision = 1;
    scan.blade_serial = "b1";
    scan.kind = "airfoil";
    scan.profile_pitch_mm = 0.05;
    scan.columns_per_profile = 100;
    scan.encoding = scan.stored_encoding = "draco";
    scan.point_count = scan.block_count = scan.stored_bytes = 1;
    scan.profile_count = 1;
    scan.stored_sha256 = scan.sent_sha256 = Sha256Hex(id);
    if (id == "s2") scan.sensor_serial_number = "LJ 4711";
    ScanBlockRow block;
    block.point_count = block.profile_count = 1;
    block.blob_sha256 = *PutBlob(*transaction, id);
    block.sent_sha256 = block.blob_sha256;
    const absl::StatusOr<Recorded> recorded =
        InsertScan(*transaction, scan, {block}, Entry("scan", "scans/" + id, {"machines/m1@1", "blades/b1"}, "b1"));
    ASSERT_TRUE(recorded.ok()) << recorded.status();
  }
  ASSERT_TRUE(transaction->Commit().ok());
  Append(Entry("registration", "registrations/r1", {"scans/s1"}, "b1"));
  Append(Entry("registration", "registrations/r2", {"scans/s2"}, "b1"));
  Append(Entry("registration", "registrations/r3", {"scans/s1", "scans/s2"}, "b1"));
  absl::StatusOr<Transaction> reading = database_.database()->Begin(Soon());
  EXPECT_THAT(NamesOf(DerivedFrom(*reading, "sensors/LJ 0815/a")),
              ElementsAre("scans/s1", "registrations/r1", "registrations/r3"));
  EXPECT_THAT(NamesOf(DerivedFrom(*reading, "sensors/LJ 4711")),
              ElementsAre("scans/s2", "registrations/r2", "registrations/r3"));
  EXPECT_THAT(NamesOf(DerivedFrom(*reading, "probes/TP-1", {"registration"})),
              ElementsAre("registrations/r1", "registrations/r2", "registrations/r3"));
  for (const char* known : {"sensors/LJ 0815/a", "sensors/LJ 4711", "probes/TP-1"})
    EXPECT_TRUE(*IsRecorded(*reading, known)) << known;
  EXPECT_FALSE(*IsRecorded(*reading, "sensors/LJ 0815"));
  EXPECT_EQ((**FindEntry(*reading, "scans/s1")).state, "KEPT");
}

TEST_F(RecordTest, RecallByTheSoftwareThatMadeIt) {
  RecordEntry old = Entry("registration", "registrations/r1", {"scans/s1"}, "b1");
  old.software_version = "0.0.9+bad";
  Append(old);
  Append(Entry("correction", "corrections/k1", {"registrations/r1"}, "b1"));
  Append(Entry("registration", "registrations/r2", {"scans/s1"}, "b1"));
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "software/0.0.9+bad")),
              ElementsAre("registrations/r1", "corrections/k1"));
  EXPECT_TRUE(*IsRecorded(*transaction, "software/0.0.9+bad"));
  EXPECT_FALSE(*IsRecorded(*transaction, "software/0.0.9"));
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "software/0.0.9")), ElementsAre());
}

// What was made of a span's things after it belongs to the recall; what was made of others after it does not.
TEST_F(RecordTest, RecallOfASpanOfTimeGoesOnWithWhatWasMadeOfItLater) {
  Append(Entry("calibration", "calibrations/c1", {"machines/m1@1"}));
  Append(Entry("registration", "registrations/r1", {"scans/s1", "calibrations/c1"}, "b1"));
  Append(Entry("registration", "registrations/r2", {"scans/s2", "calibrations/c1"}, "b2"));
  Append(Entry("registration", "registrations/r3", {"scans/s3", "calibrations/c1"}, "b3"));
  Append(Entry("inspection", "inspections/i1", {"registrations/r1"}, "b1"));
  Append(Entry("inspection", "inspections/i2", {"registrations/r2"}, "b2"));
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  const auto at = [&](const std::string& name) { return (**FindEntry(*transaction, name)).recorded.recorded_at; };
  JournalPage page;
  page.recorded = {at("registrations/r2"), at("registrations/r3")};
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "calibrations/c1", {}, page)),
              ElementsAre("registrations/r2", "inspections/i2"));
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "", {}, page)),
              ElementsAre("registrations/r2", "scans/s3", "registrations/r3", "inspections/i2"));
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "", {"inspection"}, page)), ElementsAre("inspections/i2"));
  page.limit = 1;
  std::vector<std::string> paged;
  for (;;) {
    const auto entries = DerivedFrom(*transaction, "", {}, page);
    ASSERT_TRUE(entries.ok()) << entries.status();
    if (entries->empty()) break;
    paged.push_back(entries->front().entry.name);
    page.after_sequence = entries->front().recorded.sequence;
  }
  EXPECT_THAT(paged, ElementsAre("registrations/r2", "scans/s3", "registrations/r3", "inspections/i2"));
  page = {};
  page.recorded.from = at("inspections/i2") + std::chrono::hours(1);
  EXPECT_THAT(NamesOf(DerivedFrom(*transaction, "calibrations/c1", {}, page)), ElementsAre());
}

TEST_F(RecordTest, TraceTellsWhatAThingWasMadeFrom) {
  Append(Entry("scan", "scans/plate", {"machines/m1@1", "artefacts/a1@1"}));
  Append(Entry("calibration", "calibrations/c1", {"scans/plate"}));
  Append(Entry("calibration", "calibrations/c2", {"scans/plate"}));
  Append(Entry("blade", "blades/b1", {"parts/p1@2"}, "b1"));
  Append(Entry("scan", "scans/s1", {"blades/b1", "machines/m1@1"}, "b1"));
  Append(Entry("registration", "registrations/r1", {"scans/s1", "calibrations/c1"}, "b1"));
  Append(Entry("correction", "corrections/k1", {"registrations/r1"}, "b1"));
  Append(Entry("registration", "registrations/r9", {"scans/s9", "calibrations/c2"}, "b9"));
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  EXPECT_THAT(NamesOf(MadeFrom(*transaction, "registrations/r1")),
              ElementsAre("machines/m1@1", "artefacts/a1@1", "scans/plate", "calibrations/c1", "parts/p1@2",
                          "blades/b1", "scans/s1"));
  // Of a blade with all that concerns it; in pages.
  EXPECT_THAT(NamesOf(MadeFrom(*transaction, "blades/b1")),
              ElementsAre("machines/m1@1", "artefacts/a1@1", "scans/plate", "calibrations/c1", "parts/p1@2", "scans/s1",
                          "registrations/r1", "corrections/k1"));
  const std::int64_t scanned = (**FindEntry(*transaction, "scans/s1")).recorded.sequence;
  EXPECT_THAT(NamesOf(MadeFrom(*transaction, "blades/b1", {scanned, 1})), ElementsAre("registrations/r1"));
  EXPECT_THAT(NamesOf(MadeFrom(*transaction, "machines/m1")), ElementsAre());
}

TEST_F(RecordTest, AnEntryIsFoundByItsExactName) {
  Append(Entry("machine", "machines/m1@2", {}));
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  EXPECT_EQ((**FindEntry(*transaction, "machines/m1@2")).entry.kind, "machine");
  EXPECT_FALSE(FindEntry(*transaction, "machines/m1")->has_value());
  for (const char* name : {"machines/m1", "machines/m1@2"}) EXPECT_TRUE(*IsRecorded(*transaction, name)) << name;
  for (const char* name : {"machines/m", "machines/m1@1"}) EXPECT_FALSE(*IsRecorded(*transaction, name)) << name;
}

TEST_F(RecordTest, RefusesWhatCannotBeARecord) {
  Append(Entry("scan", "scans/s1", {}));
  const RecordEntry bad[] = {
      Entry("scan", "scans/s1", {}),            // a name twice
      Entry("rumour", "rumours/r1", {}),        // no such kind
      Entry("scan", "scans/", {}),              // no id
      Entry("scan", "scans/s2", {"scans/s9"}),  // an input that is not recorded
  };
  const absl::StatusCode wanted[] = {absl::StatusCode::kAlreadyExists, absl::StatusCode::kFailedPrecondition,
                                     absl::StatusCode::kFailedPrecondition, absl::StatusCode::kFailedPrecondition};
  for (size_t i = 0; i < std::size(bad); ++i) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    const absl::Status refused = AppendRecord(*transaction, NewUuid(), bad[i]).status();
    EXPECT_EQ(refused.code(), wanted[i]) << refused;
  }
}

TEST_F(RecordTest, EveryAppendOnlyTableRefusesChange) {
  Append(Entry("scan", "scans/s1", {"machines/m1@1"}));
  {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    ASSERT_TRUE(PutBlob(*transaction, "a cloud").ok());
    ASSERT_TRUE(transaction->Commit().ok());
  }
  // Every table, and every partition, but those that say how far something has come, and what helps to find what is to be done.
  absl::StatusOr<Transaction> listing = database_.database()->Begin(Soon());
  const auto tables = listing->Execute(
      "SELECT c.relname, (SELECT a.attname FROM pg_attribute a WHERE a.attrelid = c.oid AND a.attnum > 0 "
      "AND a.attidentity = '' ORDER BY a.attnum LIMIT 1) "
      "FROM pg_class c WHERE c.relkind IN ('r', 'p') AND c.relnamespace = 'public'::regnamespace AND c.relname NOT IN "
      "('schema_migrations', 'scan_uploads', 'scan_upload_blocks', 'blob_check_progress', 'blob_use', 'loose_blobs', "
      "'retention_progress', 'credential_offers', 'certificate_renewals', 'persons', 'accounts', 'session_ends', "
      "'sign_in_failures', 'machine_activity', 'machine_contacts', 'blade_cycles', 'webhook_deliveries')");
  ASSERT_TRUE(tables.ok()) << tables.status();
  EXPECT_GT(tables->count(), 100);
  for (int row = 0; row < tables->count(); ++row) {
    const std::string table = tables->Text(row, 0), column = tables->Text(row, 1);
    for (const std::string& change : {"DELETE FROM " + table, "TRUNCATE " + table + " CASCADE",
                                      "UPDATE " + table + " SET " + column + " = " + column}) {
      absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
      const absl::Status refused = transaction->Execute(change).status();
      EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition) << change << ": " << refused;
      EXPECT_THAT(std::string(refused.message()), ::testing::HasSubstr("append-only"));
    }
  }
}

// Writers that take their number and then linger; a reader by cursor must see every number below the highest it saw.
TEST_F(RecordTest, AReaderByCursorNeverMissesAnEntry) {
  const std::unique_ptr<Database> pool = database_.Open(6);
  constexpr int kWriters = 4, kEach = 25;
  std::atomic<int> running{kWriters};
  std::vector<std::thread> writers;
  for (int writer = 0; writer < kWriters; ++writer) {
    writers.emplace_back([&, writer] {
      for (int i = 0; i < kEach; ++i) {
        absl::StatusOr<Transaction> transaction = pool->Begin(Soon(60));
        const std::string name = "scans/w" + std::to_string(writer) + "-" + std::to_string(i);
        ASSERT_TRUE(AppendRecord(*transaction, NewUuid(), Entry("scan", name, {})).ok());
        if ((i + writer) % 3 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(3));
        if (i % 10 == 9) continue;  // rolled back: leaves a gap
        ASSERT_TRUE(transaction->Commit().ok());
      }
      --running;
    });
  }
  std::int64_t cursor = 0, seen_count = 0;
  for (bool last = false; !last;) {
    last = running == 0;
    absl::StatusOr<Transaction> transaction = pool->Begin(Soon());
    const absl::StatusOr<Rows> rows = transaction->Execute(
        "SELECT record_sequence FROM record_entries WHERE record_sequence > $1 ORDER BY record_sequence",
        Params().Int(cursor));
    ASSERT_TRUE(rows.ok()) << rows.status();
    seen_count += rows->count();
    if (rows->count() > 0) cursor = rows->Int(rows->count() - 1, 0);
  }
  for (std::thread& writer : writers) writer.join();
  absl::StatusOr<Transaction> transaction = pool->Begin(Soon());
  EXPECT_EQ(seen_count, transaction->Execute("SELECT count(*) FROM record_entries")->Int(0, 0));
  EXPECT_EQ(seen_count, kWriters * (kEach - kEach / 10));
}

}  // namespace
}  // namespace sixpoint::storage
