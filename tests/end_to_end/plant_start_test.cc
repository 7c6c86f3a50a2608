// What `sixpoint up` does on a plant that is there already.
#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "services/runtime/server.h"
#include "tests/end_to_end/plant_on_this_machine.h"
#include "tests/end_to_end/plant_processes.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class PlantStartTest : public PlantOnThisMachine {
 protected:
  static int NextVersion() { return runtime::NewestMigration() + 1; }
  static std::string NextName() {
    char name[40];
    std::snprintf(name, sizeof name, "V%04d__look_ahead.sql", NextVersion());
    return name;
  }
  // The migrations of this release and one more.
  std::string NextMigrations(const std::string& sql) {
    const fs::path next = folder_ / "migrations";
    fs::remove_all(next);
    fs::copy(ThrowawayDatabase::MigrationsFolder(), next);
    std::ofstream(next / NextName()) << sql;
    return next.string();
  }
  // As after a new release: each program is newer than the plant's last start.
  void AgeLastStart() {
    fs::last_write_time(data() + "/supervisord.conf", fs::file_time_type::clock::now() - std::chrono::hours(24 * 3650));
  }
  nlohmann::json Settings() { return nlohmann::json::parse(ReadFile(data() + "/plant.json"), nullptr, false); }
  // When the program that runs now began to listen, by its own log.
  std::string ListeningSince(const std::string& area) {
    const std::string log = ReadFile(data() + "/log/" + area + ".log");
    const std::size_t line = log.rfind('\n', log.rfind("\"msg\":\"listening\"")) + 1;
    return nlohmann::json::parse(log.substr(line, log.find('\n', line) - line))["ts"];
  }
  std::string AppliedAt(int version) {
    return Sql(
        "SELECT to_char(applied_at AT TIME ZONE 'UTC', 'YYYY-MM-DD\\\"T\\\"HH24:MI:SS.MS\\\"Z\\\"') "
        "FROM schema_migrations WHERE version = " +
        std::to_string(version));
  }
};

TEST_F(PlantStartTest, BringsTheSchemaBeforeTheServices) {
  ASSERT_EQ(Up().exit_code, 0);
  const std::string before = Pid("plant");

  // One that fails changes nothing: what runs goes on.
  AgeLastStart();
  const Answer failed = Up({"--migrations", NextMigrations("SELECT 1 FROM no_such_table;")});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_THAT(failed.text, HasSubstr("no_such_table"));
  EXPECT_EQ(Pid("plant"), before);

  // While it takes its time the old services serve; the new ones come after it.
  const std::string next = NextMigrations("SELECT pg_sleep(3);");
  Answer up;
  std::thread upgrade([&] { up = Up({"--migrations", next}); });
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  EXPECT_EQ(Pid("plant"), before);
  EXPECT_EQ(ShellOutput(PlantProcesses::Program("sixpoint") + " machine list --json --server " + At("127.0.0.1")),
            "[]");
  upgrade.join();
  ASSERT_EQ(up.exit_code, 0) << up.text;
  EXPECT_NE(Pid("plant"), before);
  for (const std::string& area : PlantProcesses::Areas())
    EXPECT_GT(ListeningSince(area), AppliedAt(NextVersion())) << area;

  // The release before says what it met, and leaves it.
  const std::string after = Pid("plant");
  const Answer old = Up();
  EXPECT_EQ(old.exit_code, 1);
  EXPECT_THAT(old.text, HasSubstr("the database has " + NextName()));
  EXPECT_THAT(old.text, HasSubstr("a newer release made this database"));
  EXPECT_THAT(old.text, HasSubstr("next: run `sixpoint up` of the release that made it"));
  EXPECT_EQ(Pid("plant"), after);
}

TEST_F(PlantStartTest, AStoppedPlantGetsTheSchemaFirstToo) {
  ASSERT_EQ(Up().exit_code, 0);
  ASSERT_EQ(Run({"down", "--data", data()}).exit_code, 0);
  const Answer failed = Up({"--migrations", NextMigrations("SELECT 1 FROM no_such_table;")});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_THAT(failed.text, HasSubstr("no_such_table"));
  EXPECT_FALSE(fs::exists(data() + "/run/supervisord.pid"));  // nothing is left that it had started

  const Answer up = Up({"--migrations", NextMigrations("SELECT pg_sleep(2);")});
  ASSERT_EQ(up.exit_code, 0) << up.text;
  for (const std::string& area : PlantProcesses::Areas())
    EXPECT_GT(ListeningSince(area), AppliedAt(NextVersion())) << area;
}

TEST_F(PlantStartTest, RemembersItsFlags) {
  ASSERT_EQ(Up({"--listen", "127.0.0.2"}).exit_code, 0);
  EXPECT_EQ(Settings()["listen"], "127.0.0.2");
  ASSERT_EQ(Run({"down", "--data", data()}).exit_code, 0);

  const Answer again = Run({"up", "--data", data()});
  ASSERT_EQ(again.exit_code, 0) << again.text;
  EXPECT_THAT(again.text, HasSubstr(At("127.0.0.2") + "  SERVING"));

  const Answer moved = Run({"up", "--data", data(), "--listen", "127.0.0.3"});
  ASSERT_EQ(moved.exit_code, 0) << moved.text;
  EXPECT_THAT(moved.text, HasSubstr(At("127.0.0.3") + "  SERVING"));
  EXPECT_EQ(Settings()["base_port"], port_);
}

// One of the release before has no certificates, and a setting that there is no more.
TEST_F(PlantStartTest, APlantOfTheReleaseBeforeGetsItsCertificates) {
  ASSERT_EQ(Up().exit_code, 0);
  ASSERT_EQ(Run({"down", "--data", data()}).exit_code, 0);
  for (const char* name : {"authority", "certificates"}) fs::remove_all(fs::path(data()) / name);
  nlohmann::json settings = Settings();
  settings["insecure"] = true;
  std::ofstream(data() + "/plant.json") << settings;
  const Answer status = Run({"status", "--data", data()});
  EXPECT_EQ(status.exit_code, 1);
  EXPECT_THAT(status.text, HasSubstr("the certificate of plant is missing"));

  const Answer up = Run({"up", "--data", data()});
  ASSERT_EQ(up.exit_code, 0) << up.text;
  EXPECT_THAT(up.text, ::testing::Not(HasSubstr("warning")));
  EXPECT_FALSE(Settings().contains("insecure"));
  EXPECT_EQ(Run({"machine", "list", "--json", "--server", At("127.0.0.1")}).text, "[]\n");
}

TEST_F(PlantStartTest, RenewsCertificatesWhereOthersAreWanted) {
  ASSERT_EQ(Up().exit_code, 0);
  const auto listed = [&] {
    return nlohmann::json::parse(Run({"certs", "list", "--json", "--data", data()}).text, nullptr, false).size();
  };
  EXPECT_EQ(listed(), 8u);  // six services, the gateway, and who started them
  ASSERT_EQ(Up().exit_code, 0);
  EXPECT_EQ(listed(), 8u);
  ASSERT_EQ(Up({"--listen", "127.0.0.2"}).exit_code, 0);
  EXPECT_EQ(listed(), 15u);
  ASSERT_EQ(Run({"certs", "revoke", "services/ingest", "--data", data()}).exit_code, 0);
  EXPECT_THAT(Run({"status", "--data", data()}).text, HasSubstr("the certificate of ingest: revoked"));
  const Answer up = Up();
  ASSERT_EQ(up.exit_code, 0) << up.text;
  EXPECT_THAT(up.text, ::testing::Not(HasSubstr("warning")));
}

// A checkout under /root, for instance: copies lie beside the data, and a newer program takes the place of one that runs.
TEST_F(PlantStartTest, CopiesProgramsThatTheServiceUserCannotReach) {
  if (geteuid() != 0) GTEST_SKIP() << "SKIPPED: only root has another whom it keeps out";
  const fs::path closed = folder_ / "closed";
  ShellOutput("mkdir -m 700 " + closed.string() + "; cp " + PlantProcesses::Program("sixpoint*") + " " +
              closed.string() + "; cp -r " + ThrowawayDatabase::MigrationsFolder() + " " + closed.string());
  const std::string up = (closed / "sixpoint").string() + " up --data " + data() + " --base-port ";
  const std::string first = ShellOutput(up + std::to_string(port_));
  ASSERT_THAT(first, HasSubstr("inspection    127.0.0.1:" + std::to_string(port_ + 5) + "  SERVING")) << first;
  const std::string before = Pid("plant");
  EXPECT_EQ(fs::read_symlink("/proc/" + before + "/exe"), data() + "/bin/sixpoint-plant");
  ShellOutput("touch " + (closed / "sixpoint-plant").string());
  ASSERT_THAT(ShellOutput(up + std::to_string(port_)), HasSubstr("SERVING"));
  EXPECT_NE(Pid("plant"), before);
}

}  // namespace
}  // namespace sixpoint::testing
