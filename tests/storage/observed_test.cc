#include "storage/observed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "storage/calibration_store.h"
#include "storage/months.h"
#include "tests/support/registered.h"
#include "tests/support/sample_calibrations.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using std::chrono::hours;

class ObservedTest : public ::testing::Test {
 protected:
  // As the service reads it.
  template <typename Value>
  Value Read(const std::string& area, const std::function<absl::StatusOr<Value>(Transaction&)>& read) {
    const auto as_role = Database::Open(sixpoint::testing::AsRole(database_.conninfo(), area), 1);
    auto transaction = as_role->Begin(Soon());
    EXPECT_TRUE(transaction.ok()) << transaction.status();
    const absl::StatusOr<Value> value = read(*transaction);
    EXPECT_TRUE(value.ok()) << value.status();
    return value.ok() ? *value : Value();
  }
  std::optional<int> Months() { return Read<std::optional<int>>("plant", MonthsAhead); }
  std::int64_t Head() { return Read<std::int64_t>("plant", RecordHead); }
  std::vector<CalibrationAge> Ages(int limit = 10) {
    return Read<std::vector<CalibrationAge>>("calibration",
                                             [limit](Transaction& t) { return CalibrationAges(t, limit); });
  }
  std::string Sql(const std::string& statement) {
    auto transaction = database_.database()->Begin(Soon());
    const auto rows = transaction->Execute(statement);
    EXPECT_TRUE(rows.ok()) << rows.status();
    const std::string first = rows.ok() && rows->count() > 0 ? rows->Text(0, 0) : "";
    EXPECT_TRUE(transaction->Commit().ok());
    return first;
  }
  // Rows alone, without what else has to be there for them.
  void Put(const std::vector<std::string>& statements) {
    auto transaction = database_.database()->Begin(Soon());
    ASSERT_TRUE(transaction->Execute("SET LOCAL session_replication_role = replica").ok());
    for (const std::string& statement : statements) {
      const auto put = transaction->Execute(statement);
      ASSERT_TRUE(put.ok()) << put.status();
    }
    ASSERT_TRUE(transaction->Commit().ok());
  }
  // Of that month's partition of a table; 0: this one.
  static std::string Partition(const std::string& table, int month) {
    return "(SELECT partition_name('" + table +
           "', (date_trunc('month', now() AT TIME ZONE 'UTC') + make_interval(months => " + std::to_string(month) +
           "))::date))";
  }
  void Record(const std::string& machine, hours from, std::optional<hours> until, bool is_draft = false) {
    CalibrationRow row = sixpoint::testing::SampleRotationCalibration();
    row.calibration_id = NewUuid();
    row.machine_id = machine;
    row.inputs = {"machines/" + machine + "@1"};
    const Instant now = std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
    row.valid_from = now + from;
    if (until) row.valid_until = now + *until;
    row.requested_by = "users/jane";
    row.software_version = "test";
    row.is_draft = is_draft;
    RecordEntry entry;
    entry.kind = "calibration";
    entry.name = row.name();
    entry.inputs = row.inputs;
    entry.machine = machine;
    entry.software_version = row.software_version;
    const auto recorded =
        CalibrationsIn(database_.database())->Record({"area.Call", "", row.calibration_id}, row, entry, Soon());
    ASSERT_TRUE(recorded.ok()) << recorded.status();
  }

  ThrowawayDatabase database_;
};

TEST_F(ObservedTest, TheHeadIsTheNewestSequence) {
  EXPECT_EQ(Head(), 0);
  sixpoint::testing::RecordName(database_.database(), "machine", "machines/m1@1");
  const std::int64_t first = Head();
  EXPECT_GT(first, 0);
  sixpoint::testing::RecordName(database_.database(), "machine", "machines/m2@1");
  EXPECT_GT(Head(), first);
  EXPECT_EQ(std::to_string(Head()), Sql("SELECT max(record_sequence) FROM record_names"));
  EXPECT_EQ(Read<std::int64_t>("ingest", CountDamages), 0);
}

TEST_F(ObservedTest, MonthsAreThoseOfTheTableThatHasFewest) {
  EXPECT_EQ(Months(), kMonthsAhead);
  ASSERT_TRUE(MakeMonths(*database_.database(), 5, Soon(60)).ok());
  EXPECT_EQ(Months(), 5);
  const std::string newest =
      Sql("SELECT max(c.relname) FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid WHERE i.inhparent = "
          "'denials'::regclass");
  Sql("DROP TABLE " + newest);
  EXPECT_EQ(Months(), 4);
}

// The newest names would say 5 of each of these.
TEST_F(ObservedTest, AMonthThatIsMissingAmongOthersIsSeen) {
  ASSERT_TRUE(MakeMonths(*database_.database(), 5, Soon(60)).ok());
  Sql("DROP TABLE " + Sql("SELECT " + Partition("denials", 3)));
  EXPECT_EQ(Months(), 2);
  Sql("DROP TABLE " + Sql("SELECT " + Partition("requests", 0)));
  EXPECT_EQ(Months(), -1);
  ASSERT_TRUE(MakeMonths(*database_.database(), 5, Soon(60)).ok());
  EXPECT_EQ(Months(), 5);
}

TEST_F(ObservedTest, ABlobThatIsDamagedInTwoWaysIsOne) {
  Put(
      {"INSERT INTO blob_damages (sha256, store, what, detail) SELECT sha256(of), 'postgresql', what, '' FROM (VALUES "
       "('one'::bytea, 'size'), ('one', 'digest'), ('one', 'digest'), ('two', 'missing')) AS found (of, what)"});
  EXPECT_EQ(Read<std::int64_t>("ingest", CountDamages), 2);
}

TEST_F(ObservedTest, AgesAreOfWhatIsInForceOrWasLast) {
  auto transaction = database_.database()->Begin(Soon());
  for (const char* machine : {"m1", "m2", "m3"}) sixpoint::testing::RegisterMachine(*transaction, machine);
  ASSERT_TRUE(transaction->Commit().ok());
  EXPECT_TRUE(Ages().empty());
  // Of two that hold, the later one; one that has ended since counts only where there is no other.
  Record("m1", hours(-50), hours(1000));
  Record("m1", hours(-30), hours(100));
  Record("m1", hours(-20), hours(-10));
  Record("m2", hours(-40), hours(-30));
  Record("m2", hours(-20), hours(-10));
  Record("m3", hours(-20), hours(10), /*is_draft=*/true);
  Record("m3", hours(5), hours(10));  // not yet
  const std::vector<CalibrationAge> ages = Ages();
  ASSERT_EQ(ages.size(), 2u);
  EXPECT_EQ(ages[0].machine_id, "m1");
  EXPECT_EQ(ages[0].kind, "rotation");
  EXPECT_EQ(ages[0].axis, "");
  EXPECT_NEAR(ages[0].age_s, 30 * 3600, 600);
  EXPECT_NEAR(ages[0].left_s.value_or(0), 100 * 3600, 600);
  EXPECT_EQ(ages[1].machine_id, "m2");
  EXPECT_NEAR(ages[1].age_s, 20 * 3600, 600);
  EXPECT_NEAR(ages[1].left_s.value_or(0), -10 * 3600, 600);
  EXPECT_EQ(Ages(1).size(), 1u);
}

// What ended long ago is told of machines that still scan, and of no others.
TEST_F(ObservedTest, AMachineThatIsGoneIsNotToldForEver) {
  auto transaction = database_.database()->Begin(Soon());
  for (const char* machine : {"m1", "m2", "m3"}) sixpoint::testing::RegisterMachine(*transaction, machine);
  ASSERT_TRUE(transaction->Commit().ok());
  for (const char* machine : {"m1", "m2"}) Record(machine, hours(-24 * 60), hours(-24 * 31));
  Record("m3", hours(-24 * 60), hours(-24 * 29));
  ASSERT_EQ(Ages().size(), 1u);
  EXPECT_EQ(Ages().front().machine_id, "m3");
  Put(
      {"INSERT INTO record_entries (record_id, record_sequence, kind, machine_id, method, software_version, "
       "requested_by, "
       "summary, recorded_at) VALUES (least_uuid_of(now()), 1000000, 'scan', 'm2', '', 't', 'users/jane', '{}', "
       "now())"});
  ASSERT_EQ(Ages().size(), 2u);
  EXPECT_EQ(Ages().front().machine_id, "m2");
  EXPECT_NEAR(Ages().front().left_s.value_or(0), -24 * 31 * 3600, 600);
}

// The journal holds every scan; asked for all calibrations at once, PostgreSQL reads it from end to end.
TEST_F(ObservedTest, AgesDoNotReadTheWholeJournal) {
  const std::string name = "INSERT INTO record_names (record_id, name, record_sequence) SELECT gen_random_uuid(), ";
  Put({name + "'scans/s' || i, 1000000 + i FROM generate_series(1, 20000) i",
       name + "'calibrations/c' || i, 2000000 + i FROM generate_series(1, 3000) i",
       "INSERT INTO calibrations (calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, "
       "valid_until, requested_by, software_version) SELECT record_id, 'm' || record_sequence % 20, 'rotation', "
       "'LINES', "
       "'{}', sha256(''), now() - interval '1 year', now() + interval '1 min' * (record_sequence - 2002900), "
       "'users/jane', "
       "'t' FROM record_names WHERE name LIKE 'calibrations/%'"});
  Sql("ANALYZE record_names, calibrations");
  auto transaction = database_.database()->Begin(Soon());
  const char* const read = "SELECT pg_stat_get_xact_tuples_returned('record_names'::regclass)";
  const std::int64_t before = transaction->Execute(read)->Int(0, 0);
  const auto ages = CalibrationAges(*transaction, 100);
  ASSERT_TRUE(ages.ok()) << ages.status();
  EXPECT_EQ(ages->size(), 20u);
  EXPECT_LT(transaction->Execute(read)->Int(0, 0) - before, 1000);
}

}  // namespace
}  // namespace sixpoint::storage
