// What `sixpoint up` refuses: in one sentence, by its exit code, and with nothing changed.
#include <gmock/gmock.h>
#include <pwd.h>
#include <unistd.h>

#include <fstream>

#include "services/runtime/listening_sockets.h"
#include "tests/end_to_end/plant_on_this_machine.h"
#include "tests/end_to_end/plant_processes.h"
#include "tests/support/object_store_server.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class PlantRefusalsTest : public PlantOnThisMachine {
 protected:
  // Names, owners, modes, times of change and content of all that lies there.
  static std::string Everything(const fs::path& folder) {
    return ShellOutput("find " + folder.string() + " -printf '%p %U %m %C@ %l\\n' | sort; find " + folder.string() +
                       " -type f -exec sha256sum {} +");
  }
  void ExpectRefused(const std::string& folder, const std::string& sentence) {
    const std::string before = Everything(folder_ / "foreign");
    const Answer answer = Run({"up", "--data", folder, "--base-port", std::to_string(port_)});
    EXPECT_EQ(answer.exit_code, 1) << answer.text;
    EXPECT_THAT(answer.text, HasSubstr(sentence));
    EXPECT_EQ(Everything(folder_ / "foreign"), before);
  }
  void ExpectSaid(const Answer& answer, const std::string& sentence) {
    EXPECT_EQ(answer.exit_code, 1) << answer.text;
    EXPECT_THAT(answer.text, HasSubstr(sentence));
  }
};

TEST_F(PlantRefusalsTest, AFolderThatIsNoPlants) {
  const fs::path foreign = folder_ / "foreign";
  for (const char* name : {"home", "cluster", "empty", "odd"}) fs::create_directories(foreign / name);
  std::ofstream(foreign / "home" / "letter.txt") << "Dear Ada,\n";
  std::ofstream(foreign / "cluster" / "PG_VERSION") << "15\n";
  std::ofstream(foreign / "odd" / "plant.json") << "{\"colour\": \"green\"}\n";
  fs::create_directory_symlink("empty", foreign / "link");
  ExpectRefused(foreign / "home", "(holds something else), want an empty folder, or one that `sixpoint up` made");
  ExpectRefused(foreign / "cluster", "(a PostgreSQL cluster), want an empty folder");
  ExpectRefused(foreign / "link", "(a symbolic link), want the folder itself");
  ExpectRefused(foreign / "home" / "letter.txt", "(not a folder), want an empty folder");
  ExpectRefused(foreign / "odd", "plant.json: colour: unknown, want one of base_port");
  ExpectRefused(foreign / "two words", "two words, want at most 76 letters, digits and /._-+@");
  for (const char* word : {"status", "down"})
    ExpectSaid(Run({word, "--data", foreign / "empty"}), "want a folder made by `sixpoint up`");
  if (geteuid() != 0) GTEST_SKIP() << "SKIPPED from here on: only root can give a folder away";
  ASSERT_EQ(chown((foreign / "empty").c_str(), 1, 1), 0);
  ExpectRefused(foreign / "empty", "(of the user daemon), want a folder of root's");
}

// What the supervisor's configuration could not hold, and what the gateway could not serve.
TEST_F(PlantRefusalsTest, APageThatIsNone) {
  const fs::path page = folder_ / "two words", empty = folder_ / "empty";
  for (const fs::path& folder : {page, empty}) fs::create_directories(folder);
  std::ofstream(page / "index.html") << "<p>page";
  ExpectSaid(Up({"--web", page.string()}), "--web: " + page.string() + ", want a path of letters, digits and /._-+@");
  ExpectSaid(Up({"--web", empty.string()}), "--web: " + empty.string() + ", want a folder with index.html");
  ExpectSaid(Up({"--web", (page / "index.html").string()}), "index.html, want a folder with index.html");
  EXPECT_FALSE(fs::exists(data()));
}

TEST_F(PlantRefusalsTest, APortThatAnotherHolds) {
  ASSERT_EQ(Up().exit_code, 0);
  const std::string other = (folder_ / "other").string();
  ExpectSaid(
      Run({"up", "--data", other, "--base-port", std::to_string(port_)}),
      "--base-port: " + At("127.0.0.1") + " (another program or plant listens there), want six ports that are free");
  EXPECT_FALSE(fs::exists(other));

  auto other_program = runtime::ListenAt("127.0.0.1:0");
  ASSERT_TRUE(other_program.ok()) << other_program.status();
  const int taken = runtime::PortOf(other_program->front());
  const std::string settings = ReadFile(data() + "/plant.json"), running = Pid("all");
  ExpectSaid(Run({"up", "--data", data(), "--base-port", std::to_string(taken)}),
             ":" + std::to_string(taken) + " (another program or plant listens there)");
  other_program->clear();
  EXPECT_EQ(ReadFile(data() + "/plant.json"), settings);
  EXPECT_EQ(Pid("all"), running);

  // While this plant is down another takes its port: it is not taken for this one.
  ASSERT_EQ(Run({"down", "--data", data()}).exit_code, 0);
  ASSERT_EQ(Run({"up", "--data", other, "--base-port", std::to_string(port_)}).exit_code, 0);
  EXPECT_EQ(Run({"status", "--data", data()}).exit_code, 1);
  ExpectSaid(Run({"up", "--data", data()}), "(another program or plant listens there)");
  EXPECT_EQ(Run({"down", "--data", other}).exit_code, 0);
}

// Two plants 20 ports apart, of which one is to serve where the other is seen; each can be told to be seen elsewhere, or not at all.
TEST_F(PlantRefusalsTest, APortAtWhichItIsToBeSeen) {
  auto other_program = runtime::ListenAt("127.0.0.1:" + std::to_string(port_ + 23));
  ASSERT_TRUE(other_program.ok()) << other_program.status();
  const std::string named = "--metrics-port: 127.0.0.1:" + std::to_string(port_ + 23) +
                            " (another program or plant listens there), want ports that are free";
  ExpectSaid(Up(), named);
  EXPECT_FALSE(fs::exists(data()));
  const Answer unseen = Up({"--metrics-port", "0"});
  ASSERT_EQ(unseen.exit_code, 0) << unseen.text;
  EXPECT_THAT(unseen.text, HasSubstr("metrics       none"));
  EXPECT_FALSE(runtime::ListenAt("127.0.0.1:" + std::to_string(port_ + 23)).ok());
  EXPECT_TRUE(runtime::ListenAt("127.0.0.1:" + std::to_string(port_ + 20)).ok());
  // What runs holds none of them, so that the program is no part of it.
  ExpectSaid(Up({"--metrics-port", std::to_string(port_ + 20)}), named);
  EXPECT_EQ(Run({"status", "--data", data()}).exit_code, 0);
  const Answer seen = Up({"--metrics-port", std::to_string(port_ + 10)});
  ASSERT_EQ(seen.exit_code, 0) << seen.text;
  EXPECT_THAT(seen.text, HasSubstr("metrics       https://127.0.0.1:" + std::to_string(port_ + 10) + "/metrics"));
  EXPECT_EQ(Up().exit_code, 0);  // kept, and its own
  EXPECT_FALSE(runtime::ListenAt("127.0.0.1:" + std::to_string(port_ + 15)).ok());
}

TEST_F(PlantRefusalsTest, SettingsThatAreWrong) {
  ASSERT_EQ(Up().exit_code, 0);
  const std::string running = Pid("all");
  for (const auto& [text, sentence] :
       {std::pair("{", "plant.json: not JSON"),
        std::pair("{\"base_port\": 80}", "base_port: 80, want a whole number from 1024"),
        std::pair("{\"listen\": \"10.1.2.256\"}", "--listen: 10.1.2.256, want an IP address"),
        std::pair("{\"blob_store\": \"s3://x\\n[program:y]\"}", "blob_store:")}) {
    std::ofstream(data() + "/plant.json") << text;
    for (const char* word : {"up", "status"}) ExpectSaid(Run({word, "--data", data()}), sentence);
  }
  std::ofstream(data() + "/plant.json") << "{\"base_port\": " << port_ << "}";
  EXPECT_EQ(Pid("all"), running);
}

TEST_F(PlantRefusalsTest, ADatabaseThatIsNotFitToServe) {
  ASSERT_EQ(Up().exit_code, 0);
  Sql("ALTER ROLE sixpoint_correction SUPERUSER");
  const std::string too_much = "database role: sixpoint_correction, a superuser, want the service's own";
  Order("restart correction");
  ExpectSaid(Up(), "correction does not serve: " + too_much);
  ExpectSaid(Run({"status", "--data", data()}), "NOT_SERVING: " + too_much);
  Sql("ALTER ROLE sixpoint_correction NOSUPERUSER");

  const std::string volatile_one = "fsync: off, want on: a database that loses nothing it has kept";
  Sql("ALTER SYSTEM SET fsync = off");
  Sql("SELECT pg_reload_conf()");
  Order("restart plant");  // one that runs asks once a minute
  ExpectSaid(Up(), "plant does not serve: " + volatile_one + "\nnext: cure what it says");
  ExpectSaid(Run({"status", "--data", data()}), "NOT_SERVING: " + volatile_one);
  Sql("ALTER SYSTEM RESET fsync");
  Sql("SELECT pg_reload_conf()");
  EXPECT_EQ(Up().exit_code, 0);

  // What is new is looked at before anything is changed; a service that ends at its start is heard too.
  const std::string settings = ReadFile(data() + "/plant.json"), no_file = "--blob-store: no file /no/such.yaml";
  ExpectSaid(Up({"--blob-store", "s3:///no/such.yaml"}), no_file);
  EXPECT_EQ(ReadFile(data() + "/plant.json"), settings);
  std::ofstream(data() + "/plant.json") << "{\"base_port\": " << port_ << ", \"blob_store\": \"s3:///no/such.yaml\"}";
  ExpectSaid(Up(), "ingest does not serve: sixpoint-ingest: " + no_file);
}

TEST_F(PlantRefusalsTest, ABucketOfAnotherPlant) {
  if (!WhyNoObjectStore().empty()) GTEST_SKIP() << "SKIPPED: " << WhyNoObjectStore();
  const storage::S3Config config = ObjectStoreConfig();
  const fs::path keys = folder_ / "s3.yaml";
  std::ofstream(keys) << "endpoint: " << config.endpoint << "\nbucket: " << config.bucket
                      << "\nregion: " << config.region << "\naccess_key: " << config.access_key
                      << "\nsecret_key: " << config.secret_key << "\n";
  ASSERT_EQ(Up().exit_code, 0);
  ShellOutput("chmod 600 " + keys.string() + "; chown --reference=" + data() + "/run " + keys.string());
  const std::string bucket = "s3://" + keys.string();
  ASSERT_EQ(Up({"--blob-store", bucket}).exit_code, 0);

  const std::string other = (folder_ / "other").string(), port = std::to_string(port_ + 10);
  ExpectSaid(Run({"up", "--data", other, "--base-port", port, "--blob-store", bucket}), "bucket: of plant ");
  EXPECT_THAT(ReadFile(other + "/plant.json"), HasSubstr("\"blob_store\": \"postgresql\""));
  EXPECT_THAT(Run({"status", "--data", other}).text, HasSubstr("supervisor    not running"));

  // Told of before, it may be a plant that was restored: it starts, for a person to look, and says so.
  std::ofstream(other + "/plant.json") << "{\"base_port\": " << port << ", \"blob_store\": \"" << bucket << "\"}";
  const Answer known = Run({"up", "--data", other});
  EXPECT_EQ(known.exit_code, 0) << known.text;
  EXPECT_THAT(known.text, HasSubstr("warning: bucket: of plant "));
  EXPECT_EQ(Run({"down", "--data", other}).exit_code, 0);
}

// The service user may do what it likes below its folders; what root does there ends inside.
class RootsFollowingTest : public PlantRefusalsTest {
 protected:
  void SetUp() override {
    if (geteuid() != 0) GTEST_SKIP() << "SKIPPED: only root has another to follow";
    PlantRefusalsTest::SetUp();
  }
};

TEST_F(RootsFollowingTest, NoLinkThatTheServiceUserPlanted) {
  ASSERT_EQ(Up().exit_code, 0);
  // Nothing of root's runs in the plant, and beside its folders the service user plants nothing.
  EXPECT_EQ(ShellOutput("ps -o user= -p $(supervisorctl -c " + data() + "/supervisord.conf pid) | sort -u"),
            "sixpoint");
  for (const char* name : {"x", "plant.json", "supervisord.conf", "supervisord.conf.part", "certificates/revoked.pem",
                           "certificates/authority.pem.part", "certificates/local/x", "authority/key.pem"})
    EXPECT_THAT(ServiceShellOutput("ln -sf /etc/passwd " + data() + "/" + name), HasSubstr("Permission denied"))
        << name;
  EXPECT_THAT(ServiceShellOutput("mv " + data() + "/log " + data() + "/log2"), HasSubstr("Permission denied"));
  // Who breaks into a service makes no identities by it, and is nobody else.
  for (const char* name : {"authority/key.pem", "certificates/local/identity.pem"})
    EXPECT_THAT(ServiceShellOutput("cat " + data() + "/" + name), HasSubstr("Permission denied")) << name;

  ASSERT_EQ(Run({"down", "--data", data()}).exit_code, 0);
  const fs::path target = folder_ / "foreign" / "root-only";
  fs::create_directories(target);
  std::ofstream(target / "file") << "root's\n";
  ShellOutput("chmod 600 " + (target / "file").string());
  const std::string before = Everything(folder_ / "foreign");
  for (const char* name : {"log/ingest.log", "log/plant.log", "log/supervisord.log", "run/supervisord.pid",
                           "run/supervisor.sock", "postgres/postmaster.pid", "postgres/PG_VERSION",
                           "certificates/ingest/identity.pem", "certificates/plant/authority.pem"})
    ASSERT_EQ(ServiceShellOutput("ln -sf " + (target / "file").string() + " " + data() + "/" + name), "");
  ASSERT_EQ(ServiceShellOutput("ln -sfn " + target.string() + " " + data() + "/postgres/base"), "");
  EXPECT_EQ(Up().exit_code, 1);
  EXPECT_EQ(Everything(folder_ / "foreign"), before);
  Run({"status", "--data", data()});
  Run({"down", "--data", data()});
  EXPECT_EQ(Everything(folder_ / "foreign"), before);
}

TEST_F(RootsFollowingTest, NoFolderThatIsALink) {
  const fs::path foreign = folder_ / "foreign";
  fs::create_directories(foreign);
  for (const char* name : {"run", "log", "postgres", "authority", "certificates", "certificates/plant"}) {
    fs::create_directories((fs::path(data()) / name).parent_path());
    std::ofstream(data() + "/plant.json") << "{}";
    fs::create_directory_symlink(foreign, fs::path(data()) / name);
    const std::string before = Everything(foreign);
    ExpectSaid(Up(), std::string(name) + " (not a folder itself), want a folder of the plant's own, and no link");
    EXPECT_EQ(Everything(foreign), before);
    fs::remove_all(data());
  }
}

TEST_F(RootsFollowingTest, NoProgramOrMigrationThatTheServiceUserMayWrite) {
  const passwd* user = getpwnam("sixpoint");
  if (user == nullptr) GTEST_SKIP() << "SKIPPED: no user sixpoint yet";
  const fs::path migrations = folder_ / "migrations";
  fs::copy(ThrowawayDatabase::MigrationsFolder(), migrations);
  const std::string one = (migrations / "V0003__create_plant_registry.sql").string();
  const auto expect_refused = [&](const std::string& what) {
    ExpectSaid(Up({"--migrations", migrations}),
               "--migrations: " + what + ", want what the user sixpoint cannot write");
    EXPECT_FALSE(fs::exists(data()));
  };
  ASSERT_EQ(chown(one.c_str(), user->pw_uid, 0), 0);
  expect_refused(one);
  ASSERT_EQ(chown(one.c_str(), 0, user->pw_gid), 0);
  ShellOutput("chmod 664 " + one);
  expect_refused(one);
  ShellOutput("chmod 644 " + one + "; chmod 777 " + migrations.string());
  expect_refused(migrations.string());
  ShellOutput("chmod 755 " + migrations.string() + "; chown sixpoint " + folder_.string());
  ExpectSaid(Up({"--migrations", migrations}), ": " + folder_.string() + ", want what the user sixpoint cannot write");
  ShellOutput("chown root " + folder_.string());

  const fs::path programs = folder_ / "bin";
  fs::create_directory(programs);
  for (const char* name : {"sixpoint", "sixpoint-plant"}) fs::copy_file(PlantProcesses::Program(name), programs / name);
  ShellOutput("chown sixpoint " + (programs / "sixpoint-plant").string());
  const std::string answer = ShellOutput((programs / "sixpoint").string() + " up --data " + data() + " --migrations " +
                                         ThrowawayDatabase::MigrationsFolder());
  EXPECT_THAT(answer,
              HasSubstr("programs: " + (programs / "sixpoint-plant").string() + ", want what the user sixpoint"));
  EXPECT_FALSE(fs::exists(data()));
}

}  // namespace
}  // namespace sixpoint::testing
