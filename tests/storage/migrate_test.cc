#include "storage/migrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "sandbox/landlock.h"
#include "storage/database.h"
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
// As PostgreSQL is started, which runs as the same user as the services.
TEST_F(MigrateTest, WhatItRunsWithoutAFolderDoesNotReadIt) {
  const char* bin = std::getenv("SIXPOINT_BIN_DIR");
  ASSERT_NE(bin, nullptr) << "want the folder of the programs (ctest sets it)";
  namespace fs = std::filesystem;
  fs::create_directory(folder_ + "/keys");
  fs::create_directory(folder_ + "/data");
  std::ofstream(folder_ + "/keys/key") << "secret";
  std::ofstream(folder_ + "/data/row") << "row";
  const auto run = [&](const std::string& script) {
    return std::system((std::string(bin) + "/sixpoint-migrate --run-without " + folder_ + "/keys " + folder_ +
                        "/later --writing /dev " + folder_ + "/data -- /bin/sh -c '" + script + "' > /dev/null 2>&1")
                           .c_str());
  };
  EXPECT_EQ(run("cat " + folder_ + "/data/row && echo more >> " + folder_ + "/data/row && mv " + folder_ +
                "/data/row " + folder_ + "/data/moved && mkdir " + folder_ + "/data/within"),
            0);
  if (sandbox::LandlockVersion() == 0) GTEST_SKIP() << "this kernel has no Landlock";
  for (const std::string& read :
       {"cat " + folder_ + "/keys/key", "echo other >> " + folder_ + "/V0001__create_first.sql",
        "cat " + folder_ + "/data/../keys/key", "echo mine >> " + folder_ + "/keys/key", "rm " + folder_ + "/keys/key",
        "mv " + folder_ + "/keys " + folder_ + "/data/keys", "mkdir " + folder_ + "/later",
        "cat /proc/" + std::to_string(getpid()) + "/root" + folder_ + "/keys/key",
        "ln " + folder_ + "/keys/key " + folder_ + "/data/key"})
    EXPECT_NE(run(read), 0) << read;
  EXPECT_NE(run("ln -s ../keys/key " + folder_ + "/data/link; cat " + folder_ + "/data/link"), 0);
  EXPECT_NE(std::system((std::string(bin) + "/sixpoint-migrate --run-without /x > /dev/null 2>&1").c_str()), 0);
}

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

// Every text that comes from outside has an end: a check of its length or form, a list of what it may be, or a foreign key to one
// that has.
TEST_F(MigrateTest, EveryTextColumnIsBounded) {
  ASSERT_TRUE(Migrate(database_.conninfo(), ThrowawayDatabase::MigrationsFolder()).ok());
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  const auto unbounded = transaction->Execute(
      "SELECT c.relname || '.' || a.attname FROM pg_attribute a JOIN pg_class c ON c.oid = a.attrelid "
      "AND c.relkind IN ('r', 'p') AND NOT c.relispartition AND c.relnamespace = 'public'::regnamespace "
      "WHERE a.attnum > 0 AND NOT a.attisdropped AND a.atttypid IN ('text'::regtype, 'text[]'::regtype, "
      "'jsonb'::regtype) AND c.relname <> 'schema_migrations' "
      "AND NOT EXISTS (SELECT 1 FROM pg_constraint k WHERE k.conrelid = c.oid AND a.attnum = ANY (k.conkey) "
      "AND (k.contype = 'f' OR pg_get_constraintdef(k.oid) ~ ('(length|cardinality|column_size)\\(' || a.attname) "
      "OR pg_get_constraintdef(k.oid) ~ ('[(]' || a.attname || ' (~|=) '))) ORDER BY 1");
  ASSERT_TRUE(unbounded.ok()) << unbounded.status();
  for (int row = 0; row < unbounded->count(); ++row) ADD_FAILURE() << unbounded->Text(row, 0);
}

}  // namespace
}  // namespace sixpoint::storage
