// What programs are given and cannot use: one plain sentence, an exit code that is not 0, and nothing changed.
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "services/runtime/listening_sockets.h"
#include "tests/end_to_end/plant_on_this_machine.h"
#include "tests/end_to_end/plant_processes.h"
#include "tests/support/plant_certificates.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string Everything(const fs::path& folder) {
  return ShellOutput("{ find " + folder.string() + " -printf '%p %U %m %C@ %l\\n' | sort; find " + folder.string() +
                     " -type f -exec sha256sum {} +; }");
}

// A server that says that it is PostgreSQL 13.4, and nothing else.
class OldPostgres {
 public:
  OldPostgres() : sockets_(runtime::ListenAt("127.0.0.1:0").value()), thread_([this] { Serve(); }) {}
  ~OldPostgres() {
    stopping_ = true;
    thread_.join();
  }
  std::string conninfo() const {
    return "host=127.0.0.1 port=" + std::to_string(runtime::PortOf(sockets_.front())) +
           " dbname=sixpoint user=sixpoint_ingest sslmode=disable gssencmode=disable";
  }

 private:
  static std::string Message(char type, const std::string& body) {
    const auto size = static_cast<std::uint32_t>(body.size() + 4);
    std::string message(1, type);
    for (const int shift : {24, 16, 8, 0}) message += static_cast<char>(size >> shift);
    return message + body;
  }
  void Serve() const {
    using std::string_literals::operator""s;
    while (!stopping_) {
      pollfd waiting{sockets_.front().get(), POLLIN, 0};
      if (poll(&waiting, 1, 50) <= 0) continue;
      const int client = accept(sockets_.front().get(), nullptr, nullptr);
      char startup[1024];
      if (client >= 0 && recv(client, startup, sizeof startup, 0) > 0) {
        const std::string answer = Message('R', "\0\0\0\0"s) + Message('S', "server_version\0"s + "13.4\0"s) +
                                   Message('S', "client_encoding\0UTF8\0"s) + Message('Z', "I");
        send(client, answer.data(), answer.size(), MSG_NOSIGNAL);
        pollfd closed{client, POLLIN, 0};
        poll(&closed, 1, 1000);
      }
      close(client);
    }
  }
  std::vector<runtime::Descriptor> sockets_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

// Of a service alone: what it is told on its command line.
class ServiceInputTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "sixpoint-input-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::vector<std::string> Ingest(const fs::path& certificates,
                                  const std::string& database = "host=/nowhere dbname=x") {
    return {PlantProcesses::Program("sixpoint-ingest"),
            "--listen",
            "unix:" + (folder_ / "socket").string(),
            "--database",
            database,
            "--certificates",
            certificates.string(),
            "--revoked",
            certificates_.revoked_file().string()};
  }
  // Ends by itself, and says that; in one line where it is a service's log.
  void ExpectEnds(const std::vector<std::string>& command, const std::string& sentence) {
    const std::string log = (folder_ / "log").string(), before = Everything(certificates_.folder());
    fs::remove(log);
    Process process(command, log);
    const int exit_code = process.Wait(60);
    EXPECT_GT(exit_code, 0) << "0: it ended well; -1: it runs\n" << ReadFile(log);
    EXPECT_LT(exit_code, 128) << "a signal";
    EXPECT_THAT(ReadFile(log), HasSubstr(sentence));
    EXPECT_EQ(Everything(certificates_.folder()), before);
    EXPECT_FALSE(fs::exists(folder_ / "socket"));
  }
  fs::path folder_;
  PlantCertificates certificates_;
};

TEST_F(ServiceInputTest, ACertificateThatIsNotItsOwn) {
  const fs::path own = certificates_.Service("ingest"), other = certificates_.Service("plant");
  const auto with = [&](const std::string& name, const std::string& identity, const std::string& authority) {
    const fs::path made = folder_ / name;
    fs::create_directory(made);
    std::ofstream(made / "identity.pem") << identity;
    std::ofstream(made / "authority.pem") << authority;
    fs::permissions(made / "identity.pem", fs::perms::owner_read);
    return made;
  };
  const std::string own_pem = ReadFile(own / "identity.pem"), other_pem = ReadFile(other / "identity.pem"),
                    authority = ReadFile(own / "authority.pem");
  const std::string begin = "-----BEGIN CERTIFICATE-----";
  PlantCertificates foreign("another plant");
  ExpectEnds(Ingest(other), "identity.pem (of services/plant), want one of services/ingest");
  ExpectEnds(Ingest(foreign.User("jane", {identity::Role::kEngineer})), "(of users/jane), want one of services/ingest");
  ExpectEnds(Ingest(with("foreign", ReadFile(foreign.Service("ingest") / "identity.pem"), authority)),
             "identity.pem: not signed by the authority, want one that the plant's authority gave");
  ExpectEnds(
      Ingest(with("key", own_pem.substr(0, own_pem.find(begin)) + other_pem.substr(other_pem.find(begin)), authority)),
      "a certificate of another key, want that of the key beside it");
  ExpectEnds(Ingest(with("nothing", "", authority)), "identity.pem");
  ExpectEnds(Ingest(folder_ / "no-such-folder"), "identity.pem");
  ExpectEnds(Ingest(with("no-authority", own_pem, "")), "authority.pem");
}

TEST_F(ServiceInputTest, WhatNobodyKnows) {
  std::vector<std::string> command = Ingest(certificates_.Service("ingest"));
  command.emplace_back("--colour=green");
  ExpectEnds(command, "The following argument was not expected: --colour=green");
  for (const char* program : {"sixpoint-migrate", "sixpoint-watchdog", "sixpoint-plant"})
    ExpectEnds({PlantProcesses::Program(program), "--colour"}, "");
  command = Ingest(certificates_.Service("ingest"));
  command.insert(command.end(), {"--threads", "many"});
  ExpectEnds(command, "--threads");
}

TEST_F(ServiceInputTest, APortThatAnotherHolds) {
  const auto other = runtime::ListenAt("127.0.0.1:0");
  ASSERT_TRUE(other.ok());
  std::vector<std::string> command = Ingest(certificates_.Service("ingest"));
  command[2] = "127.0.0.1:" + std::to_string(runtime::PortOf(other->front()));
  ExpectEnds(command, "\"msg\":\"cannot listen\",\"why\":\"");
  EXPECT_THAT(ReadFile((folder_ / "log").string()), HasSubstr(command[2]));
}

TEST_F(ServiceInputTest, AnOldPostgres) {
  const OldPostgres old;
  const std::string sentence = "PostgreSQL: version 13.4, want 15 or newer";
  ExpectEnds({PlantProcesses::Program("sixpoint-migrate"), "--database", old.conninfo(), "--migrations",
              ThrowawayDatabase::MigrationsFolder(), "--wait-s", "1"},
             sentence);
  // A service waits for a better one, and says so.
  const std::string log = (folder_ / "ingest.log").string();
  Process ingest(Ingest(certificates_.Service("ingest"), old.conninfo()), log);
  for (int i = 0; i < 300 && ReadFile(log).find(sentence) == std::string::npos; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_THAT(ReadFile(log), HasSubstr("\"msg\":\"not ready: " + sentence + "\""));
}

TEST_F(ServiceInputTest, ASchemaThatIsNewerOrNobodys) {
  ThrowawayDatabase database;
  const std::vector<std::string> migrate = {PlantProcesses::Program("sixpoint-migrate"),
                                            "--database",
                                            database.conninfo(),
                                            "--migrations",
                                            ThrowawayDatabase::MigrationsFolder(),
                                            "--wait-s",
                                            "1"};
  const auto psql = [&](const std::string& sql) {
    return ShellOutput("psql '" + database.conninfo() + "' -Atc \"" + sql + "\"");
  };
  const std::string known = psql("SELECT max(version) FROM schema_migrations");
  psql("INSERT INTO schema_migrations (version, name, sha256) VALUES (" + known + " + 1, 'V9999__more.sql', '0')");
  const std::string dump =
      "pg_dump --no-comments '" + database.conninfo() + "' | grep -v -e '^.restrict' -e '^.unrestrict' | sha256sum";
  const std::string before = ShellOutput(dump);
  ExpectEnds(migrate,
             "the database has V9999__more.sql, want a folder that has it too (a newer release made this database)");
  EXPECT_EQ(ShellOutput(dump), before);
  std::vector<std::string> no_folder = migrate;
  no_folder[4] = (folder_ / "nothing").string();
  ExpectEnds(no_folder, "migrations: ");
  std::vector<std::string> unreadable = migrate;
  unreadable[2] = "host=/tmp password=se cret dbname=x";
  ExpectEnds(unreadable, "database: --database: not readable, want a connection string");
  EXPECT_THAT(ReadFile((folder_ / "log").string()), ::testing::Not(HasSubstr("cret")));
}

class PlantInputTest : public PlantOnThisMachine {
 protected:
  // One sentence (and what to do next), and nothing in the folder is as it was not.
  void ExpectRefused(const fs::path& folder, const std::string& sentence) {
    const std::string before = Everything(folder);
    const Answer answer = Run({"up", "--data", folder.string(), "--base-port", std::to_string(port_)});
    EXPECT_EQ(answer.exit_code, 1) << answer.text;
    EXPECT_THAT(answer.text, HasSubstr(sentence));
    EXPECT_THAT(answer.text, HasSubstr("\nnext: "));
    EXPECT_EQ(Everything(folder), before);
  }
};

TEST_F(PlantInputTest, AFolderOfAnotherVersionOrPlant) {
  ASSERT_EQ(Up().exit_code, 0);
  ASSERT_EQ(Run({"down", "--data", data()}).exit_code, 0);
  const std::string file = data() + "/plant.json", settings = ReadFile(file);
  const auto with = [&](const char* key, const nlohmann::json& value) {
    nlohmann::json changed = nlohmann::json::parse(settings);
    changed[key] = value;
    std::ofstream(file) << changed.dump();
  };
  with("layout", 2);
  ExpectRefused(data(), "layout: 2, want 1 or less: a newer release made this folder");
  with("colour", "green");
  ExpectRefused(data(), "colour: unknown, want one of");
  with("database_system", "7434000000000000000");
  ExpectRefused(data(), ", another plant's), want 7434000000000000000, as plant.json has it");
  std::ofstream(file) << settings;
  EXPECT_THAT(settings, HasSubstr("\"database_system\": \"" +
                                  ShellOutput("/usr/lib/postgresql/15/bin/pg_controldata " + data() +
                                              "/postgres | sed -n 's/^Database system identifier: *//p'") +
                                  "\""));

  const std::string version = data() + "/postgres/PG_VERSION";
  std::ofstream(version) << "13\n";
  ExpectRefused(data(), "/postgres (of PostgreSQL 13), want one of PostgreSQL 15: move it by pg_upgrade");
  std::ofstream(version) << "15\n";
  ASSERT_EQ(Up().exit_code, 0);
  // Of a database that a newer release has changed; what it asked it for, it asked without changing it.
  Sql("INSERT INTO schema_migrations (version, name, sha256) SELECT max(version) + 1, 'V9999__more.sql', '0' FROM "
      "schema_migrations");
  const std::string dump = "pg_dump --no-comments -h " + data() +
                           "/run -U sixpoint sixpoint | grep -v -e '^.restrict' -e '^.unrestrict' | sha256sum";
  const std::string before = ShellOutput(dump), pids = Pid("all");
  const Answer newer = Up();
  EXPECT_EQ(newer.exit_code, 1);
  EXPECT_THAT(newer.text, HasSubstr("a newer release made this database"));
  EXPECT_THAT(newer.text, HasSubstr("next: run `sixpoint up` of the release that made it"));
  EXPECT_EQ(ShellOutput(dump), before);
  EXPECT_EQ(Pid("all"), pids);
}

TEST_F(PlantInputTest, ADiskThatIsFullOrCannotBeWritten) {
  const fs::path disk = folder_ / "disk";
  fs::create_directory(disk);
  if (geteuid() != 0 || mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=20m,mode=755") != 0)
    GTEST_SKIP() << "SKIPPED: no file system can be mounted here";
  ExpectRefused(disk / "plant", " MB free), want a disk with at least 500 MB free");
  EXPECT_TRUE(fs::is_empty(disk));
  ASSERT_EQ(mount("tmpfs", disk.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, "size=900m"), 0);
  ExpectRefused(disk / "plant", "(mounted to be read only), want a folder that can be written");
  EXPECT_EQ(umount2(disk.c_str(), MNT_DETACH), 0);
  ExpectRefused("/proc/plant", "--data: /proc/plant (");
}

TEST_F(PlantInputTest, AFolderThatOnlyAnotherUserCanWrite) {
  if (geteuid() != 0) GTEST_SKIP() << "SKIPPED: only root can be another user too";
  const fs::path closed = folder_ / "closed", programs = folder_ / "bin";
  fs::create_directory(closed);
  fs::create_directory(programs);
  // Where the other user reaches them.
  ShellOutput("cp " + PlantProcesses::Program("sixpoint") + " " + PlantProcesses::Program("sixpoint-") + "* " +
              programs.string());
  ShellOutput("cp -r " + ThrowawayDatabase::MigrationsFolder() + " " + folder_.string());
  const std::string before = Everything(closed);
  const std::string answer = ServiceShellOutput(programs.string() + "/sixpoint up --data " +
                                                (closed / "plant").string() + " --base-port " + std::to_string(port_));
  EXPECT_THAT(answer, HasSubstr("--data: " + closed.string()));
  EXPECT_THAT(answer, HasSubstr("(Permission denied), want a folder that sixpoint can write"));
  EXPECT_EQ(Everything(closed), before);
}

}  // namespace
}  // namespace sixpoint::testing
