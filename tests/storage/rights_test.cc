// What each service's role may do in the database, and what it may not (migrations/V0010).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "storage/bucket_owner.h"
#include "storage/calibration_store.h"
#include "storage/correction_events.h"
#include "storage/corrections.h"
#include "storage/database.h"
#include "storage/drawing_store.h"
#include "storage/inspections.h"
#include "storage/months.h"
#include "storage/plant_store.h"
#include "storage/record.h"
#include "storage/registrations.h"
#include "storage/retention_store.h"
#include "storage/scan_uploads.h"
#include "storage/scans.h"
#include "storage/studies.h"
#include "tests/support/registered.h"
#include "tests/support/stored_scan.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::AsRole;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const char* const kAreas[] = {"plant", "ingest", "calibration", "registration", "correction", "inspection"};

class RightsTest : public ::testing::Test {
 protected:
  std::unique_ptr<Database> As(const std::string& area) const {
    return Database::Open(AsRole(database_.conninfo(), area), 1);
  }
  static absl::StatusOr<Rows> Ask(Database& database, const std::string& sql) {
    absl::StatusOr<Transaction> transaction = database.Begin(Soon());
    if (!transaction.ok()) return transaction.status();
    return transaction->Execute(sql);
  }
  ThrowawayDatabase database_;
};

TEST_F(RightsTest, NoServiceChangesTheRecordOrSwitchesATriggerOff) {
  for (const char* area : kAreas) {
    const auto database = As(area);
    for (const char* sql :
         {"UPDATE record_entries SET kind = 'scan'", "DELETE FROM record_names", "TRUNCATE record_inputs",
          "DELETE FROM requests", "UPDATE registrations SET outcome = 'CONVERGED'", "DELETE FROM inspections",
          "UPDATE scans SET kind = 'arm'", "ALTER TABLE record_entries DISABLE TRIGGER ALL",
          "ALTER TABLE blobs DISABLE TRIGGER USER", "SET session_replication_role = replica",
          "DROP TABLE record_entries", "CREATE TABLE mine ()",
          "CREATE OR REPLACE FUNCTION refuse_change() RETURNS "
          "trigger LANGUAGE plpgsql AS 'BEGIN RETURN NEW; END'",
          "SELECT detach_month('2020-01-01')", "COPY record_names TO PROGRAM 'true'"}) {
      const absl::Status refused = Ask(*database, sql).status();
      EXPECT_THAT(std::string(refused.message()), ::testing::AnyOf(HasSubstr("[42501]"), HasSubstr("[0A000]")))
          << area << ": " << sql;
    }
    EXPECT_TRUE(database->RequireLeastRights(Soon()).ok()) << area;
  }
}

// The owner, and whoever belongs to it, could do all of that.
TEST_F(RightsTest, AServiceThatMayTooMuchIsTold) {
  const absl::Status told = database_.database()->RequireLeastRights(Soon());
  EXPECT_EQ(told.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(told.message()), HasSubstr("database role: sixpoint, a superuser, want"));
}

// By the database's own books: who may insert into, change or read what.
TEST_F(RightsTest, EachServiceWritesItsOwnTablesOnly) {
  const auto rights = [&](const std::string& right) {
    std::map<std::string, std::set<std::string>> areas_of;
    const absl::StatusOr<Rows> rows =
        Ask(*database_.database(),
            "SELECT c.relname, substr(r.rolname, 10) FROM pg_class c CROSS JOIN pg_roles r WHERE r.rolname LIKE "
            "'sixpoint\\_%' AND c.relkind IN ('r', 'p') AND c.relnamespace IN ('public'::regnamespace, "
            "'detached'::regnamespace) AND has_table_privilege(r.oid, c.oid, '" +
                right + "')");
    EXPECT_TRUE(rows.ok()) << rows.status();
    for (int row = 0; rows.ok() && row < rows->count(); ++row) areas_of[rows->Text(row, 0)].insert(rows->Text(row, 1));
    return areas_of;
  };
  const std::set<std::string> shared = {"record_names", "record_entries", "record_inputs", "record_roots",
                                        "requests",     "blobs",          "denials"};
  for (const auto& [table, areas] : rights("INSERT"))
    EXPECT_TRUE(areas.size() == 1 || shared.count(table) > 0) << table << ": " << areas.size();
  for (const auto& [table, areas] : rights("DELETE"))
    EXPECT_THAT(table, ::testing::AnyOf("scan_uploads", "scan_upload_blocks", "blobs", "loose_blobs",
                                        "credential_offers", "sign_in_failures"))
        << *areas.begin();
  for (const auto& [table, areas] : rights("UPDATE"))  // of whole rows
    EXPECT_THAT(table, ::testing::AnyOf("scan_uploads", "scan_upload_blocks", "blob_check_progress",
                                        "retention_progress", "webhook_deliveries"));
  EXPECT_THAT(rights("TRUNCATE"), IsEmpty());
  EXPECT_THAT(rights("TRIGGER"), IsEmpty());
  // The ledger's role, which no service has but while it seals or checks, reads all of the record.
  EXPECT_EQ(rights("SELECT")["registrations"], (std::set<std::string>{"ledger", "registration"}));
}

TEST_F(RightsTest, EachMayAppendToTheJournalAndIngestMakesMonths) {
  sixpoint::testing::RegisterUsual(database_.database());
  for (const char* area : kAreas) {
    const auto database = As(area);
    absl::StatusOr<Transaction> transaction = database->Begin(Soon());
    RecordEntry entry;
    entry.kind = "scan";
    entry.name = std::string("scans/of-") + area;
    entry.inputs = {"machines/m1@1"};
    entry.software_version = "test";
    entry.request = KeptRequest{"area.Call", NewUuid(), std::string(64, 'a')};
    const auto recorded = AppendRecord(*transaction, NewUuid(), entry);
    ASSERT_TRUE(recorded.ok()) << area << ": " << recorded.status();
    EXPECT_TRUE(transaction->Commit().ok());
    EXPECT_EQ(Ask(*database, "SELECT make_partitions(4)").ok(), std::string(area) == "ingest") << area;
  }
}

// All that the keeper of the store does by itself, as it does it.
TEST_F(RightsTest, IngestKeepsTheStore) {
  const std::unique_ptr<BlobStore> store = MakePostgresqlBlobStore();
  sixpoint::testing::PutScanSubjects(database_.database());
  sixpoint::testing::PutScan(database_.database(), store.get(), "old", "artefact", {"old points"}, 40);
  sixpoint::testing::PutScan(database_.database(), store.get(), "young", "artefact", {"young points"}, 3);
  const auto ingest = As("ingest");
  const auto retention = RetentionIn(ingest.get(), MakePostgresqlBlobStore());
  RetentionPolicy policy;
  policy.scan_kind = "artefact";
  policy.keep_days = 30;
  policy.requested_by = "test";
  RecordEntry entry;
  entry.software_version = "test";
  ASSERT_TRUE(retention->Record({"ingest.SetRetentionPolicy", NewUuid(), ""}, policy, entry, Soon()).ok());
  RetentionOptions options;
  options.software_version = options.requested_by = "test";
  const auto applied = retention->Apply(options, Soon(60));
  ASSERT_TRUE(applied.ok()) << applied.status();
  EXPECT_EQ(applied->scan_count, 1);
  const auto keeping = BlobKeepingIn(ingest.get(), MakePostgresqlBlobStore());
  CollectOptions everything;
  everything.grace = std::chrono::seconds(0);
  const auto collected = keeping->Collect(everything, Soon(60));
  ASSERT_TRUE(collected.ok()) << collected.status();
  const absl::Status checked = keeping->Check({}, {}, Soon(60));
  EXPECT_TRUE(checked.ok()) << checked;
  const auto status = keeping->Status(10, Soon(60));
  EXPECT_TRUE(status.ok()) << status.status();
  EXPECT_TRUE(keeping->Months(Soon()).ok());
  absl::StatusOr<Transaction> transaction = ingest->Begin(Soon());
  EXPECT_TRUE(ForgetUploads(*transaction, std::chrono::system_clock::now()).ok());
  EXPECT_TRUE(ForgetRequests(*transaction).ok());
  EXPECT_TRUE(KeepCheckFinished(*transaction).ok());
  EXPECT_TRUE(BucketOwnerHere(*transaction).ok());
  ScanFilter of_part;
  of_part.part_id = "p1";
  EXPECT_TRUE(ListScans(*transaction, of_part, 0, 10).ok());
}

// And what the others ask of lists, with every filter.
TEST_F(RightsTest, EachReadsItsOwnLists) {
  ResultFilter all;
  all.blade_serial = all.machine_id = all.part_id = "none";
  all.calibration_id = NewUuid();
  RegistrationFilter registrations;
  CorrectionFilter corrections;
  InspectionFilter inspections;
  static_cast<ResultFilter&>(registrations) = static_cast<ResultFilter&>(corrections) = all;
  static_cast<ResultFilter&>(inspections) = all;
  const auto registration = As("registration"), correction = As("correction"), inspection = As("inspection"),
             calibration = As("calibration");
  EXPECT_TRUE(RegistrationsIn(registration.get())->List(registrations, 0, 10, Soon()).ok());
  EXPECT_TRUE(CorrectionsIn(correction.get())->List(corrections, 0, 10, Soon()).ok());
  EXPECT_TRUE(CorrectionEventsIn(correction.get())->CutHoles("none", Soon()).ok());
  EXPECT_TRUE(InspectionsIn(inspection.get())->List(inspections, 0, 10, Soon()).ok());
  EXPECT_TRUE(CalibrationsIn(calibration.get())->List({}, 0, 10, Soon()).ok());
  EXPECT_TRUE(StudiesIn(calibration.get())->List({}, 0, 10, Soon()).ok());
  const auto plant = As("plant");
  EXPECT_TRUE(PlantIn(plant.get()).blades->List({}, "", 10, Soon()).ok());
  EXPECT_TRUE(PlantIn(plant.get()).parts->List({}, "", 10, Soon()).ok());
  EXPECT_TRUE(PlantIn(plant.get()).machining_models->List({}, "", 10, Soon()).ok());
  EXPECT_TRUE(DrawingsIn(plant.get())->List({}, "", 10, Soon()).ok());
  EXPECT_TRUE(DrawingsIn(plant.get())->Find("none", 0, Soon()).ok());
  EXPECT_TRUE(PlantIn(plant.get()).journal->DerivedFrom("machines/m1", {}, {}, Soon()).ok());
}

}  // namespace
}  // namespace sixpoint::storage
