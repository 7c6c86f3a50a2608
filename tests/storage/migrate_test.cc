#include "storage/migrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "storage/calibrations.h"
#include "storage/database.h"
#include "storage/record.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using ::testing::HasSubstr;

class MigrateTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "/sixpoint-migrations-XXXXXX";
    ASSERT_NE(mkdtemp(folder_.data()), nullptr);
    Write("V0001__create_first.sql", "CREATE TABLE first (id integer);");
    Write("V0002__create_second.sql", "CREATE TABLE second (id integer); INSERT INTO second VALUES (1);");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void Write(const std::string& name, const std::string& sql) { std::ofstream(folder_ + "/" + name) << sql; }
  absl::StatusOr<int> Run() { return Migrate(database_.conninfo(), folder_); }
  std::int64_t Ask(const std::string& sql) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    const absl::StatusOr<Rows> rows = transaction->Execute(sql);
    EXPECT_TRUE(rows.ok()) << rows.status();
    return rows.ok() ? rows->Int(0, 0) : -1;
  }
  ThrowawayDatabase database_{ThrowawayDatabase::Schema::kEmpty};
  std::string folder_;
};

TEST_F(MigrateTest, AppliesWhatIsMissingOnce) {
  ASSERT_EQ(*Run(), 2);
  ASSERT_EQ(*Run(), 2);
  EXPECT_EQ(Ask("SELECT count(*) FROM second"), 1);
  Write("V0003__add_third.sql", "INSERT INTO second VALUES (2);");
  ASSERT_EQ(*Run(), 3);
  EXPECT_EQ(Ask("SELECT count(*) FROM second"), 2);
  EXPECT_EQ(*database_.database()->SchemaVersion(Soon()), 3);
}

TEST_F(MigrateTest, RefusesAFileThatChangedAfterItWasApplied) {
  ASSERT_TRUE(Run().ok());
  Write("V0001__create_first.sql", "CREATE TABLE first (id bigint);");
  const absl::Status refused = Run().status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("V0001__create_first.sql has changed"));
}

TEST_F(MigrateTest, RefusesAGapARepeatAndAnotherNameForm) {
  Write("V0004__skip_one.sql", "SELECT 1;");
  EXPECT_EQ(Run().status().code(), absl::StatusCode::kFailedPrecondition);
  std::filesystem::remove(folder_ + "/V0004__skip_one.sql");
  Write("V0002__create_again.sql", "SELECT 1;");
  EXPECT_EQ(Run().status().code(), absl::StatusCode::kFailedPrecondition);
  std::filesystem::remove(folder_ + "/V0002__create_again.sql");
  Write("V3_odd.sql", "SELECT 1;");
  EXPECT_EQ(Run().status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(*database_.database()->SchemaVersion(Soon()), 0);  // nothing was applied by any of them
}

TEST_F(MigrateTest, RefusesADatabaseThatANewerReleaseMade) {
  ASSERT_TRUE(Run().ok());
  std::filesystem::remove(folder_ + "/V0002__create_second.sql");
  const absl::Status refused = Run().status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("V0002__create_second.sql"));
}

TEST_F(MigrateTest, AFailingFileLeavesNothingOfItself) {
  Write("V0003__half.sql", "CREATE TABLE third (id integer); INSERT INTO third VALUES ('x');");
  const absl::Status failed = Run().status();
  EXPECT_FALSE(failed.ok());
  EXPECT_THAT(std::string(failed.message()), HasSubstr("V0003__half.sql"));
  EXPECT_EQ(*database_.database()->SchemaVersion(Soon()), 2);
  EXPECT_EQ(Ask("SELECT count(*) FROM pg_tables WHERE tablename = 'third'"), 0);
  Write("V0003__half.sql", "CREATE TABLE third (id integer);");
  EXPECT_EQ(*Run(), 3);
}

TEST_F(MigrateTest, AFileMayNotEndItsTransaction) {
  Write("V0003__commit.sql", "CREATE TABLE third (id integer); COMMIT;");
  EXPECT_EQ(Run().status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(*database_.database()->SchemaVersion(Soon()), 2);
}

TEST_F(MigrateTest, TwoRunnersAtOnceTakeTurns) {
  std::vector<absl::StatusOr<int>> versions(4, absl::UnknownError("not run"));
  std::vector<std::thread> runners;
  for (absl::StatusOr<int>& version : versions) runners.emplace_back([&] { version = Run(); });
  for (std::thread& runner : runners) runner.join();
  for (const absl::StatusOr<int>& version : versions) {
    ASSERT_TRUE(version.ok()) << version.status();
    EXPECT_EQ(*version, 2);
  }
  EXPECT_EQ(Ask("SELECT count(*) FROM second"), 1);
}

// The launcher starts both at once, and after a crash the server refuses for some seconds.
TEST_F(MigrateTest, TheProgramWaitsForAServerThatIsStillStarting) {
  const char* bin = std::getenv("SIXPOINT_BIN_DIR");
  ASSERT_NE(bin, nullptr) << "want the folder of the programs (ctest sets it)";
  const std::string command = std::string(bin) + "/sixpoint-migrate --database '" + database_.conninfo() +
                              "' --migrations '" + folder_ + "' > /dev/null 2>&1";
  ThrowawayDatabase::KillServer();
  EXPECT_NE(std::system((command + " --wait-s 0.2").c_str()), 0);
  int status = -1;
  std::thread program([&] { status = std::system(command.c_str()); });
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  ThrowawayDatabase::StartServer();
  program.join();
  EXPECT_EQ(status, 0);
  EXPECT_EQ(*database_.database()->SchemaVersion(Soon()), 2);
}

TEST_F(MigrateTest, TheProjectsOwnMigrationsApplyTwiceWithoutADifference) {
  const absl::StatusOr<int> first = Migrate(database_.conninfo(), ThrowawayDatabase::MigrationsFolder());
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(*Migrate(database_.conninfo(), ThrowawayDatabase::MigrationsFolder()), *first);
  EXPECT_GE(*first, 1);
}

// V0013 makes calibrations of axis characterisations, V0020 names them so; those of a plant that has some keep figures and time.
TEST_F(MigrateTest, NoArrayTakesANullElement) {
  ASSERT_TRUE(Migrate(database_.conninfo(), ThrowawayDatabase::MigrationsFolder()).ok());
  EXPECT_EQ(
      Ask("SELECT count(*) FROM pg_attribute a JOIN pg_class c ON c.oid = a.attrelid AND c.relkind = 'r' "
          "AND c.relnamespace = 'public'::regnamespace JOIN pg_type t ON t.oid = a.atttypid AND t.typcategory = 'A' "
          "WHERE a.attnum > 0 AND NOT EXISTS (SELECT 1 FROM pg_constraint k WHERE k.conrelid = c.oid "
          "AND k.contype = 'c' AND k.conkey = ARRAY[a.attnum] "
          "AND pg_get_constraintdef(k.oid) LIKE '%array_position(' || a.attname || ', NULL%')"),
      0);
  EXPECT_EQ(Ask("SELECT count(*) FROM (VALUES (is_triple('{1,NULL,3}')), (is_triple('{1,2}')), (is_triple('{}')), "
                "(is_triple('{1,2,NaN}')), (is_unit('{1,NULL,0}')), (is_unit('{1,1,0}'))) AS t (taken) WHERE taken"),
            0);
  EXPECT_EQ(Ask("SELECT count(*) FROM (VALUES (is_triple('{1,2,3}')), (is_triple(NULL)), (is_unit('{0,-1,0}')), "
                "(is_unit(NULL))) AS t (taken) WHERE taken"),
            4);
}

TEST_F(MigrateTest, CharacterisationsFromBeforeTheyWereCalibrationsAreKept) {
  const std::filesystem::path all = ThrowawayDatabase::MigrationsFolder(), before = folder_ + "/before";
  std::filesystem::create_directory(before);
  for (const auto& file : std::filesystem::directory_iterator(all))
    if (file.path().filename().string() < "V0013") std::filesystem::copy(file.path(), before);
  ASSERT_EQ(*Migrate(database_.conninfo(), before), 12);
  {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    for (const std::string sql :
         {"INSERT INTO machines (machine_id) VALUES ('m1')",
          "INSERT INTO blobs (sha256, size_bytes, bytes) VALUES (repeat('0', 64), 0, '')",
          "INSERT INTO record_entries (record_sequence, kind, name, software_version, recorded_at) VALUES (7, "
          "'calibration', 'characterisations/00000000-0000-7000-8000-000000000001', 'old', '2026-03-01 12:00:00Z')",
          "INSERT INTO axis_characterisations VALUES ('00000000-0000-7000-8000-000000000001', 'm1', 'B', "
          "'{machines/m1@3}', repeat('0', 64), 762, '{0.015,1e-5}', '{0.001,1e-5}', 1, '{0.012,1e-5}', 40, "
          "'{0.003,1e-5}', 1e-4, '{0.02,1e-5}', 90, true, '{0.01,1e-5}', '{1e-4,1e-5}', '{5e-4,1e-5}', "
          "'{1,2,3,4}', '{-1,-2,-3,-4}', 2e-5, 'engineer', 'old', 7, '2026-03-01 12:00:00Z')",
          "INSERT INTO record_entries (record_sequence, kind, name, software_version) VALUES (8, 'calibration', "
          "'calibrations/00000000-0000-7000-8000-000000000002', 'old')",
          "INSERT INTO record_inputs VALUES (8, 0, 'characterisations/00000000-0000-7000-8000-000000000001')"}) {
      const auto done = transaction->Execute(sql);
      ASSERT_TRUE(done.ok()) << done.status();
    }
    ASSERT_TRUE(transaction->Commit().ok());
  }
  ASSERT_GE(*Migrate(database_.conninfo(), all), 13);
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  const auto found =
      CalibrationInForce(*transaction, {"m1", "axis", "B"}, std::chrono::system_clock::from_time_t(1772452800));
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_TRUE(found->has_value());
  const CalibrationRow& row = **found;
  EXPECT_EQ(row.name(), "calibrations/00000000-0000-7000-8000-000000000001");
  EXPECT_TRUE((*FindEntry(*transaction, row.name())).has_value());
  EXPECT_EQ(DerivedFrom(*transaction, row.name())->size(), 1u);
  EXPECT_EQ(row.method, "ENCODER_RUN");
  EXPECT_EQ(row.requested_by, "engineer");
  EXPECT_EQ(row.software_version, "old");
  EXPECT_EQ(row.recorded.sequence, 7);
  EXPECT_EQ(row.valid_from, row.recorded.recorded_at);
  EXPECT_EQ(row.valid_until - row.valid_from, std::chrono::hours(365 * 24));
  EXPECT_EQ(row.inputs, std::vector<std::string>{"machines/m1@3"});
  EXPECT_EQ(row.axis->reversal.value_deg, 0.015);
  EXPECT_EQ(row.axis->periodic_order, 40);
  EXPECT_EQ(row.axis->noise.value_deg, 5e-4);
  EXPECT_EQ(row.axis->backward_error_deg, (std::vector<double>{-1, -2, -3, -4}));
  EXPECT_FALSE(row.axis->beyond_limits_count);
  EXPECT_FALSE(transaction->Execute("DELETE FROM axis_characterisations").ok());
}

// V0018 keeps what was said by the limit of its time, and tells which registrations inspections rest on by the journal.
TEST_F(MigrateTest, RegistrationsFromBeforeTheirVerdictWasKeptHaveThatOfTheirTime) {
  const std::filesystem::path all = ThrowawayDatabase::MigrationsFolder(), before = folder_ + "/before";
  std::filesystem::create_directory(before);
  for (const auto& file : std::filesystem::directory_iterator(all))
    if (file.path().filename().string() < "V0018") std::filesystem::copy(file.path(), before);
  ASSERT_EQ(*Migrate(database_.conninfo(), before), 17);
  const auto id_of = [](int number) { return "00000000-0000-7000-8000-00000000000" + std::to_string(number); };
  {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    const auto run = [&](const std::string& sql) {
      const auto done = transaction->Execute(sql);
      ASSERT_TRUE(done.ok()) << done.status();
    };
    run("SET LOCAL session_replication_role = replica");  // what registrations refer to plays no part
    const char* const ratios[] = {"NULL, NULL", "10, 2.9", "10, 3.5", "10, 9"};
    for (int i = 0; i < 4; ++i)
      run("INSERT INTO registrations (registration_id, blade_serial, machine_id, machine_revision, part_id, "
          "part_revision, method, sensor_calibration_id, rotation_calibration_id, outcome, zero_from_part, "
          "reference_mm, covariance, noise_covariance, calibration_sensitivity, point_count, points_used, "
          "iteration_count, residual_rms_um, residual_sigma_um, condition_number, weakest_direction, "
          "weakest_standard_uncertainty_um, remark, compute_seconds, requested_by, software_version, record_sequence, "
          "recorded_at, disagreement_um, disagreement_ratio) VALUES ('" +
          id_of(i) +
          "', 'b', 'm', 1, 'p', 1, 'SIX_POINT', 's', 'r', 'NOT_CONVERGED', '{}', '{}', '{}', '{}', '{}', 9, 0, 1, 1, "
          "1, 2, '{1,0,0,0,0,0}', 1, '', 1, '', 'old', " +
          std::to_string(i + 1) + ", now(), " + ratios[i] + ")");
    run("INSERT INTO record_entries (record_sequence, kind, name, software_version) VALUES "
        "(11, 'inspection', 'inspections/" +
        id_of(5) + "', 'old'), (12, 'correction', 'corrections/" + id_of(6) + "', 'old')");
    run("INSERT INTO record_inputs VALUES (11, 0, 'registrations/" + id_of(1) + "'), (11, 1, 'registrations/" +
        id_of(3) + "'), (12, 0, 'registrations/" + id_of(2) + "')");
    ASSERT_TRUE(transaction->Commit().ok());
  }
  ASSERT_GE(*Migrate(database_.conninfo(), all), 18);
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  const auto rows =
      transaction->Execute("SELECT disagrees, for_inspection FROM registrations ORDER BY registration_id");
  ASSERT_TRUE(rows.ok()) << rows.status();
  ASSERT_EQ(rows->count(), 4);
  EXPECT_TRUE(rows->IsNull(0, 0));
  EXPECT_FALSE(rows->Bool(1, 0));
  EXPECT_TRUE(rows->Bool(2, 0));
  EXPECT_TRUE(rows->Bool(3, 0));
  EXPECT_FALSE(rows->Bool(0, 1));
  EXPECT_TRUE(rows->Bool(1, 1));
  EXPECT_FALSE(rows->Bool(2, 1));
  EXPECT_TRUE(rows->Bool(3, 1));
  EXPECT_FALSE(transaction->Execute("UPDATE registrations SET disagrees = false").ok());  // append-only as before
}

}  // namespace
}  // namespace sixpoint::storage
