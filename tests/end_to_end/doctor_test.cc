// `sixpoint doctor` of real plants that are broken in real ways.
#include <errno.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/mount.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "identity/certificates.h"
#include "services/runtime/listening_sockets.h"
#include "tests/end_to_end/plant_on_this_machine.h"
#include "tests/end_to_end/plant_processes.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

class DoctorTest : public PlantOnThisMachine {
 protected:
  struct Told {
    int exit_code = -1;
    json answer;
    std::string Grade(const std::string& check) const { return Of(check, "grade"); }
    std::string Words(const std::string& check) const { return Of(check, "words"); }
    // Of the worst line of that name.
    std::string Of(const std::string& check, const char* what) const {
      std::string found, grade;
      for (const json& each : answer.value("checks", json::array())) {
        if (each["check"] != check || grade == "WRONG") continue;
        found = each[what];
        grade = each["grade"];
      }
      return found;
    }
  };
  Told Ask() {
    const Answer answer = Run({"doctor", "--json", "--data", data()});
    Told told{answer.exit_code, json::parse(answer.text, nullptr, false)};
    EXPECT_TRUE(told.answer.is_object()) << answer.text;
    if (!told.answer.is_object()) told.answer = json::object();
    // The exit code says no more and no less than the lines.
    EXPECT_EQ(told.exit_code, told.answer.value("wrong_count", 0) > 0 ? 1 : 0) << answer.text;
    return told;
  }
  // Until it says so: services and watchdog take their time.
  Told AskUntil(const std::function<bool(const Told&)>& so, double patience_s = 60) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience_s);
    for (;;) {
      Told told = Ask();
      if (so(told) || std::chrono::steady_clock::now() > end) return told;
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
  }
  void ExpectTold(const Told& told, const std::string& check, const std::string& grade, const std::string& words) {
    EXPECT_EQ(told.Grade(check), grade) << check << "\n" << told.answer.dump(1);
    EXPECT_THAT(told.Words(check), HasSubstr(words)) << check;
    EXPECT_EQ(told.Of(check, "next").empty(), grade == "OK") << check;
  }
  static bool AllOk(const Told& told, const std::vector<std::string>& checks) {
    return std::all_of(checks.begin(), checks.end(), [&](const auto& check) { return told.Grade(check) == "OK"; });
  }
  static void ExpectOk(const Told& told, const std::vector<std::string>& checks) {
    for (const std::string& check : checks) EXPECT_EQ(told.Grade(check), "OK") << check << ": " << told.Words(check);
  }
  // The same certificate of the same authority, with an end that is past.
  void Expire(const std::string& identity_file) const {
    const identity::AuthorityKey authority{
        identity::KeyOfPem(ReadFile(data() + "/authority/key.pem")).value(),
        identity::CertificateOfPem(ReadFile(data() + "/certificates/authority.pem")).value()};
    const identity::OwnKey own = identity::OwnKeyOf(ReadFile(identity_file)).value();
    const identity::IssuedCertificate known = identity::IssuedOf(own.certificate.get()).value();
    const auto now = std::chrono::system_clock::now();
    const identity::Certificate expired =
        identity::NewCertificate(authority, own.key.get(), known.identity, known.hosts,
                                 {now - std::chrono::hours(2), now - std::chrono::hours(1)})
            .value();
    std::ofstream(identity_file) << identity::PemOf(own.key.get()).value() << identity::PemOf(expired.get()).value();
  }
  static std::string Everything(const fs::path& folder) {
    return ShellOutput("{ find " + folder.string() + " -printf '%p %U %m %C@ %l\\n' | sort; find " + folder.string() +
                       " -type f -exec sha256sum {} +; }");
  }
};

TEST_F(DoctorTest, APlantThatRunsIsWell) {
  ASSERT_EQ(Up().exit_code, 0);
  std::vector<std::string> well = {"supervisor",
                                   "watchdog",
                                   "restarts",
                                   "ports",
                                   "clocks of services",
                                   "file descriptors",
                                   "versions",
                                   "PostgreSQL",
                                   "PostgreSQL: durable",
                                   "PostgreSQL: clock",
                                   "PostgreSQL: connections",
                                   "PostgreSQL: transaction numbers",
                                   "PostgreSQL: slow statements",
                                   "PostgreSQL: long transactions",
                                   "PostgreSQL: journal",
                                   "schema",
                                   "months",
                                   "store: damage",
                                   "store: check",
                                   "store: retention",
                                   "certificate: authority",
                                   "certificate: you"};
  for (const std::string& area : PlantProcesses::Areas()) {
    well.push_back("service: " + area);
    well.push_back("certificate: " + area);
  }
  // A machine that has much else to do takes its time.
  const Told told = AskUntil([&](const Told& now) { return AllOk(now, well); }, 30);
  ExpectOk(told, well);
  for (const char* check : {"disk: data folder", "memory", "kernel", "clock"})
    EXPECT_NE(told.Grade(check), "") << check;
  EXPECT_THAT(Run({"doctor", "--data", data()}).text, HasSubstr(" wrong, "));
  // Of a plant elsewhere, by its answers alone.
  const Answer remote = Run({"doctor", "--json", "--server", "localhost:" + std::to_string(port_)});
  const json answer = json::parse(remote.text, nullptr, false);
  ASSERT_TRUE(answer.is_object()) << remote.text;
  EXPECT_EQ(remote.exit_code, 0) << remote.text;
  EXPECT_GE(answer["ok_count"], 9) << remote.text;

  // Down, it is one thing that is wrong, and looking changes nothing.
  ASSERT_EQ(Run({"down", "--data", data()}).exit_code, 0);
  const std::string before = Everything(data());
  const Told down = Ask();
  ExpectTold(down, "supervisor", "WRONG", "nothing of this plant runs");
  EXPECT_EQ(down.Of("supervisor", "next"), "sixpoint up");
  EXPECT_EQ(down.answer["wrong_count"], 1) << down.answer.dump(1);
  EXPECT_EQ(Everything(data()), before);
  std::ofstream(data() + "/plant.json") << "{\"colour\": \"green\"}";
  ExpectTold(Ask(), "settings", "WRONG", "colour: unknown");
  EXPECT_EQ(Run({"doctor", "--data", (folder_ / "nothing").string()}).exit_code, 1);
  const Answer nobody = Run({"doctor", "--server", "localhost:" + std::to_string(port_)});
  EXPECT_EQ(nobody.exit_code, 1);
  EXPECT_THAT(nobody.text, HasSubstr("WRONG    services"));
}

TEST_F(DoctorTest, WhatIsBrokenInTheDatabase) {
  ASSERT_EQ(Up().exit_code, 0);
  const std::string month =
      "partition_name('record_entries', (date_trunc('month', now() AT TIME ZONE 'UTC') + interval '1 month')::date)";
  const std::string next = Sql("SELECT " + month);
  Sql("ALTER TABLE " + next + " RENAME TO away");
  Sql("INSERT INTO blob_damages (sha256, store, what, detail) VALUES (sha256('x'), 'postgresql', 'digest', 'x')");
  Sql("ALTER SYSTEM SET fsync = off");
  Sql("SELECT pg_reload_conf()");
  // Somebody who looked at something by hand and went to lunch; and somebody who waits behind him.
  const std::string psql = "psql -h " + data() + "/run -U sixpoint -d sixpoint -c ";
  Process lunch({"/bin/bash", "-c", psql + "'BEGIN; SELECT pg_advisory_xact_lock(6021, 1); SELECT pg_sleep(120)'"},
                (folder_ / "lunch.log").string());
  const std::string held = "SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND classid = 6021 AND objid = 1";
  for (int i = 0; i < 300 && Sql(held) == "0"; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  Process waiting({"/bin/bash", "-c", psql + "'SELECT pg_advisory_xact_lock(6021, 1)'"},
                  (folder_ / "waiting.log").string());
  const Told told = AskUntil([](const Told& now) {
    return now.Grade("PostgreSQL: slow statements") == "WARNING" && now.Grade("PostgreSQL: journal") == "WRONG" &&
           now.Words("PostgreSQL: journal").find("1 transaction waits") == 0;  // and none of the plant's own beside it
  });
  ExpectTold(told, "PostgreSQL: slow statements", "WARNING", "run for more than 10 s, the oldest is sixpoint's");
  ExpectTold(told, "PostgreSQL: journal", "WRONG", "1 transaction waits for the journal, which is sixpoint's");
  ExpectTold(told, "PostgreSQL: durable", "WRONG", "fsync off");
  ExpectTold(told, "store: damage", "WRONG", "1 blob was found damaged");
  ExpectTold(told, "months", "WARNING", "made for 0 months ahead");
  Sql("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE query LIKE '%pg_sleep(120)%' AND pid <> "
      "pg_backend_pid()");
  waiting.Wait(30);

  // What a service's own sentence says, once its database is away.
  Order("stop postgres");
  const Told away = AskUntil([](const Told& now) { return now.Grade("service: plant") == "WRONG"; });
  ExpectTold(away, "PostgreSQL", "WRONG", "does not answer");
  ExpectTold(away, "service: plant", "WRONG", "runs and does not serve: database: not reachable");
}

TEST_F(DoctorTest, WhatIsBrokenInProcessesAndCertificates) {
  ASSERT_EQ(Up().exit_code, 0);
  Order("stop watchdog");
  const std::string stuck = Pid("ingest");
  ASSERT_EQ(ServiceShellOutput("kill -STOP " + stuck), "");
  const std::string correction = data() + "/certificates/correction/identity.pem",
                    inspection = data() + "/certificates/inspection/identity.pem",
                    calibration = data() + "/certificates/calibration/identity.pem";
  ShellOutput("chmod 644 " + correction);
  // The certificate of another key, and one whose time is over.
  // Whole: gRPC ends a process that reads an empty one.
  ShellOutput("(openssl pkey -in " + correction + "; openssl x509 -in " + inspection + ") > " + inspection +
              ".new; chmod 600 " + inspection + ".new; chown --reference=" + inspection + " " + inspection +
              ".new; mv " + inspection + ".new " + inspection);
  Expire(calibration);
  ShellOutput("kill -SEGV " + Pid("registration"));
  const Told told = AskUntil([](const Told& now) { return now.Grade("crashes") == "WRONG"; });
  ExpectTold(told, "watchdog", "WRONG", "does not run (STOPPED)");
  ExpectTold(told, "service: ingest", "WRONG", "it is stuck");
  ExpectTold(told, "certificate: correction", "WRONG", "others than its owner may read the private key");
  ExpectTold(told, "certificate: inspection", "WRONG", "another key");
  ExpectTold(told, "certificate: calibration", "WRONG", "expired");
  ExpectTold(told, "crashes", "WRONG", "registration 1 time");
  ASSERT_EQ(ServiceShellOutput("kill -CONT " + stuck), "");

  // A port that another program took meanwhile.
  Order("stop plant");
  auto other = runtime::ListenAt("127.0.0.1:" + std::to_string(port_));
  ASSERT_TRUE(other.ok()) << other.status();
  const Told taken = Ask();
  // The kernel keeps 15 letters of a program's name.
  const std::string holder = std::string(program_invocation_short_name).substr(0, 15);
  if (geteuid() == 0)
    ExpectTold(taken, "ports", "WRONG",
               std::to_string(port_) + " by " + holder + " (pid " + std::to_string(getpid()) + ")");
  EXPECT_EQ(taken.Grade("service: plant"), "WRONG");
  other->clear();

  // `up` mends what it can: keys that do not fit, certificates that ended.
  const Answer up = Up();
  EXPECT_EQ(up.exit_code, 0) << up.text;
  const std::vector<std::string> mended = {"certificate: inspection", "certificate: calibration", "watchdog", "ports"};
  ExpectOk(AskUntil([&](const Told& now) { return AllOk(now, mended); }), mended);

  // A supervisor that hangs does not hang the doctor.
  const std::string supervisor = Order("pid");
  ASSERT_EQ(ServiceShellOutput("kill -STOP " + supervisor), "");
  ExpectTold(Ask(), "supervisor", "WRONG", "it is stuck");
  ASSERT_EQ(ServiceShellOutput("kill -CONT " + supervisor), "");
}

TEST_F(DoctorTest, ADiskThatIsFull) {
  const std::string disk = (folder_ / "disk").string();
  fs::create_directory(disk);
  if (geteuid() != 0 || mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=900m,mode=755") != 0)
    GTEST_SKIP() << "SKIPPED: no file system can be mounted here";
  const std::string there = disk + "/plant";
  const std::vector<std::string> options = {"--data", there};
  EXPECT_EQ(Run({"up", "--data", there, "--base-port", std::to_string(port_)}).exit_code, 0);
  // The plant that runs there gives back a little now and then.
  std::string words;
  for (int i = 0; i < 20 && words.find("0 bytes free of 944 MB at " + there) == std::string::npos; ++i) {
    ShellOutput("head -c 1G /dev/zero > " + disk + "/heap" + std::to_string(i));
    const json told = json::parse(Run({"doctor", "--json", "--data", there}).text, nullptr, false);
    if (!told.is_object()) continue;
    for (const json& each : told.value("checks", json::array()))
      if (each["check"] == "disk: data folder" && each["grade"] == "WRONG") words = each["words"];
  }
  EXPECT_THAT(words, HasSubstr("0 bytes free of 944 MB at " + there));
  Run({"down", "--data", there});
  EXPECT_EQ(umount2(disk.c_str(), MNT_DETACH), 0);
}

}  // namespace
}  // namespace sixpoint::testing
