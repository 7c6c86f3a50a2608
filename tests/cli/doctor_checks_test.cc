// What the doctor says of facts that are made up: each way in which a plant can be broken has its grade, its words and what to do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "cli/doctor/checks.h"

namespace sixpoint::cli::doctor {
namespace {

using std::chrono::hours;
using ::testing::HasSubstr;

identity::IssuedCertificate CertificateFor(hours from_now) {
  identity::IssuedCertificate certificate;
  certificate.identity = {identity::Kind::kService, "ingest", {identity::Role::kService}};
  certificate.not_after = std::chrono::system_clock::now() + from_now;
  certificate.not_before = certificate.not_after - hours(24 * 397);
  return certificate;
}

// A plant of which nothing is wrong.
Facts Healthy() {
  Facts facts;
  facts.is_local = true;
  facts.data = "/srv/plant";
  facts.own_version = "0.1.0+abc";
  facts.newest_migration = 15;
  facts.now = std::chrono::system_clock::now();
  facts.host.disks = {{"data folder", "/srv/plant", "", 500e9, 1000e9, 0.9, false}};
  facts.host.memory_bytes = 64e9;
  facts.host.available_memory_bytes = 32e9;
  facts.host.clock_synchronised = true;
  facts.host.clock_error_s = 0.01;
  facts.host.seccomp = true;
  facts.host.landlock_version = 3;
  facts.supervised = true;
  facts.watchdog_state = "RUNNING";
  int port = 7400;
  for (const char* area : {"plant", "ingest"}) {
    Service service;
    service.area = area;
    service.address = "127.0.0.1:" + std::to_string(port);
    service.health = "SERVING";
    service.answer_s = 0.01;
    service.version = service.program_version = facts.own_version;
    service.clock_ahead_s = 0.001;
    service.clock_doubt_s = 0.005;
    service.shown = CertificateFor(hours(24 * 300));
    service.state = "RUNNING";
    service.pid = port;
    service.port = port;
    service.listeners_known = true;
    service.listener = Listener{port, "sixpoint-plant"};
    service.descriptor_count = 60;
    service.descriptor_limit = 4096;
    facts.services.push_back(service);
    ++port;
  }
  CertificateFile file;
  file.whose = "ingest";
  file.path = "/srv/plant/certificates/ingest/identity.pem";
  file.certificate = CertificateFor(hours(24 * 300));
  facts.certificates = {file};
  Database database;
  database.version_number = 150008;
  database.settings = {
      {"fsync", "on"}, {"full_page_writes", "on"}, {"synchronous_commit", "on"}, {"data_checksums", "on"}};
  database.clock_ahead_s = 0.0;
  database.clock_doubt_s = 0.01;
  database.connection_count = 20;
  database.connection_limit = 100;
  database.oldest_xid_age = 1000;
  database.size_bytes = 1'000'000'000;
  database.schema_version = 15;
  database.months_ahead = 3;
  database.damage_count = 0;
  database.overdue_scan_count = 0;
  database.blob_count = 1;
  database.check_finished_at = facts.now - hours(20);
  facts.database = database;
  facts.restarts = Restarts();
  return facts;
}

const Finding* Worst(const Findings& findings) {
  const Finding* worst = nullptr;
  for (const Finding& each : findings)
    if (each.grade != Grade::kOk && each.grade != Grade::kUnknown && (worst == nullptr || each.grade > worst->grade))
      worst = &each;
  return worst;
}

TEST(DoctorChecks, FindNothingWhereNothingIs) {
  const Findings findings = Judge(Healthy());
  for (const Finding& each : findings) {
    EXPECT_EQ(each.grade, Grade::kOk) << each.check << ": " << each.words;
    EXPECT_EQ(each.next, "") << each.check;
    EXPECT_NE(each.words, "") << each.check;
  }
  EXPECT_GE(findings.size(), 20u);
}

struct Way {
  const char* name;
  std::function<void(Facts*)> break_it;
  Grade grade;
  const char* words;
  const char* next;
};
void PrintTo(const Way& way, std::ostream* out) { *out << way.name; }

class BrokenPlantTest : public ::testing::TestWithParam<Way> {};

TEST_P(BrokenPlantTest, IsToldInPlainWordsWithWhatToDo) {
  Facts facts = Healthy();
  GetParam().break_it(&facts);
  const Findings findings = Judge(facts);
  const Finding* const worst = Worst(findings);
  ASSERT_NE(worst, nullptr);
  EXPECT_EQ(GradeText(worst->grade), GradeText(GetParam().grade));
  EXPECT_THAT(worst->words, HasSubstr(GetParam().words));
  EXPECT_THAT(worst->next, HasSubstr(GetParam().next));
  EXPECT_NE(worst->next, "");
}

INSTANTIATE_TEST_SUITE_P(
    Ways, BrokenPlantTest,
    ::testing::Values(
        Way{"disk nearly full", [](Facts* f) { f->host.disks[0].free_bytes = 10e9; }, Grade::kWarning, "10 GB free of 1.0 TB at /srv/plant", "make room"},
        Way{"disk full", [](Facts* f) { f->host.disks[0].free_bytes = 1e9; }, Grade::kWrong, "1.0 GB free", "make room"},
        Way{"small disk full", [](Facts* f) { f->host.disks[0].total_bytes = 10e6; f->host.disks[0].free_bytes = 0; }, Grade::kWrong, "0 bytes free of 10 MB", "make room"},
        Way{"no inodes", [](Facts* f) { f->host.disks[0].free_inode_part = 0.001; }, Grade::kWrong, "inodes", "make room"},
        Way{"read only", [](Facts* f) { f->host.disks[0].read_only = true; }, Grade::kWrong, "read only", "dmesg"},
        Way{"memory", [](Facts* f) { f->host.available_memory_bytes = 0.1e9; }, Grade::kWrong, "100 MB available of 64 GB", "ps -eo"},
        Way{"clock free", [](Facts* f) { f->host.clock_synchronised = false; }, Grade::kWarning, "kept by no time service", "timedatectl"},
        Way{"clock bad", [](Facts* f) { f->host.clock_error_s = 16; }, Grade::kWarning, "within 16 s", "timedatectl"},
        Way{"no seccomp", [](Facts* f) { f->host.seccomp = false; }, Grade::kWrong, "no seccomp", "allow seccomp"},
        Way{"no landlock", [](Facts* f) { f->host.landlock_version = 0; }, Grade::kWarning, "no Landlock", "lsm="},
        Way{"down", [](Facts* f) { f->supervised = false; f->services.clear(); f->database->why_not = "no such file"; }, Grade::kWrong, "nothing of this plant runs", "sixpoint up"},
        Way{"supervisor stuck", [](Facts* f) { f->supervised = false; f->supervisor_why_not = "the supervisor does not answer within 5 s: it is stuck"; }, Grade::kWrong, "stuck", "sixpoint down"},
        Way{"watchdog", [](Facts* f) { f->watchdog_state = "STOPPED"; }, Grade::kWrong, "does not run (STOPPED)", "sixpoint up"},
        Way{"crash", [](Facts* f) { f->restarts->crashes["ingest"] = f->restarts->unexpected_ends["ingest"] = 1; }, Grade::kWrong, "ingest 1 time", "supervisord"},
        Way{"restarts", [](Facts* f) { f->restarts->unexpected_ends["ingest"] = 9; }, Grade::kWarning, "ingest 9 times", "--level warning"},
        Way{"stuck", [](Facts* f) { f->restarts->ended_by_watchdog["plant"] = 2; }, Grade::kWarning, "plant 2 times", "watchdog"},
        Way{"service not ready", [](Facts* f) { f->services[1].health = "NOT_SERVING"; f->services[1].why = "fsync: off, want on"; }, Grade::kWrong, "does not serve: fsync: off, want on", "sixpoint logs ingest"},
        Way{"service away", [](Facts* f) { f->services[1].health = "NOT_REACHED"; }, Grade::kWrong, "nothing answers at 127.0.0.1:7401", "sixpoint logs ingest"},
        Way{"service silent", [](Facts* f) { f->services[1].health = "SILENT"; }, Grade::kWrong, "it is stuck", "signal KILL ingest"},
        Way{"service foreign", [](Facts* f) { f->services[1].health = "NOT_TRUSTED"; }, Grade::kWrong, "does not show a certificate of this plant's authority", "certs renew"},
        Way{"service refuses", [](Facts* f) { f->services[1].refused = "certificate: revoked"; }, Grade::kWarning, "refuses us: certificate: revoked", "certs show"},
        Way{"service slow", [](Facts* f) { f->services[1].answer_s = 2.5; }, Grade::kWarning, "2500 ms", "sixpoint logs ingest"},
        Way{"port of another", [](Facts* f) { f->services[1].listener = Listener{4711, "nc\x1b[2J"}; }, Grade::kWrong, "7401 by nc?[2J (pid 4711)", "--base-port"},
        Way{"clock of a service", [](Facts* f) { f->services[1].clock_ahead_s = -90; }, Grade::kWrong, "ingest's by -90 s", "one time service"},
        Way{"descriptors", [](Facts* f) { f->services[1].descriptor_count = 4000; }, Grade::kWrong, "ingest has 4000 of 4096", "ulimit"},
        Way{"few descriptors", [](Facts* f) { f->services[1].descriptor_limit = 256; }, Grade::kWarning, "ingest may have 256", "ulimit"},
        Way{"old process", [](Facts* f) { f->services[1].program_version = "0.2.0"; }, Grade::kWarning, "still run the program before", "sixpoint up"},
        Way{"releases mixed", [](Facts* f) { f->services[1].version = f->services[1].program_version = "0.2.0"; }, Grade::kWarning, "different releases run: 0.1.0+abc, 0.2.0", "sixpoint up"},
        Way{"old tool", [](Facts* f) { f->own_version = "0.0.9"; }, Grade::kWarning, "this tool is 0.0.9", "tool of the plant's"},
        Way{"certificate expired", [](Facts* f) { f->certificates[0].certificate = CertificateFor(hours(-1)); f->certificates[0].standing = "certificate: expired"; }, Grade::kWrong, "has expired: it held until", "certs renew"},
        Way{"certificate ends", [](Facts* f) { f->certificates[0].certificate = CertificateFor(hours(24 * 5)); }, Grade::kWarning, "expires soon", "certs renew"},
        Way{"certificate revoked", [](Facts* f) { f->certificates[0].certificate->revoked_at = f->now; }, Grade::kWrong, "was taken back", "certs renew"},
        Way{"certificate's key", [](Facts* f) { f->certificates[0].why_not = "identity.pem: a certificate of another key"; }, Grade::kWrong, "of another key", "certs renew"},
        Way{"key readable", [](Facts* f) { f->certificates[0].others_read = true; }, Grade::kWrong, "others than its owner may read the private key", "chmod 600"},
        Way{"other authority", [](Facts* f) { f->certificates[0].is_other_authoritys = true; }, Grade::kWrong, "another authority", "certs renew"},
        Way{"no key of the authority", [](Facts* f) { CertificateFile key; key.is_authority = key.is_missing = true; key.whose = "authority"; key.path = "/srv/plant/authority/key.pem"; f->certificates.push_back(key); }, Grade::kWarning, "/srv/plant/authority/key.pem: not there", "put it back"},
        Way{"revocation list", [](Facts* f) { f->revocation_why_not = "revoked.pem: no such file"; }, Grade::kWrong, "services believe nobody", "certs renew"},
        Way{"shown expired", [](Facts* f) { f->services[1].shown = CertificateFor(hours(-1)); }, Grade::kWrong, "expired, until", "certs renew"},
        Way{"database away", [](Facts* f) { f->database->why_not = "connection refused"; }, Grade::kWrong, "does not answer: connection refused", "sixpoint logs postgres"},
        Way{"old PostgreSQL", [](Facts* f) { f->database->version_number = 130004; }, Grade::kWrong, "version 13.4, want 15 or newer", "pg_upgrade"},
        Way{"not durable", [](Facts* f) { f->database->settings["fsync"] = "off"; }, Grade::kWrong, "fsync off", "ALTER SYSTEM RESET fsync"},
        Way{"no checksums", [](Facts* f) { f->database->settings["data_checksums"] = "off"; }, Grade::kWarning, "no checksums", "pg_checksums"},
        Way{"damaged pages", [](Facts* f) { f->database->checksum_failure_count = 2; }, Grade::kWrong, "2 damaged pages were read", "backup"},
        Way{"database's clock", [](Facts* f) { f->database->clock_ahead_s = 3600; }, Grade::kWrong, "ahead of ours", "time service"},
        Way{"connections", [](Facts* f) { f->database->connection_count = 100; }, Grade::kWrong, "100 of 100 in use", "pg_stat_activity"},
        Way{"slow statement", [](Facts* f) { f->database->slow = {{"ada", "SELECT pg_sleep(99)", 7, 42}}; }, Grade::kWarning, "ada's for 42 s (pid 7): SELECT pg_sleep(99)", "pg_cancel_backend(7)"},
        Way{"long transaction", [](Facts* f) { f->database->long_transactions = {{"ada", "BEGIN", 7, 4200}}; }, Grade::kWarning, "open for more than a minute", "pg_cancel_backend(7)"},
        Way{"journal waits", [](Facts* f) { f->database->journal_waiter_count = 3; f->database->journal_holder = Statement{"ada", "BEGIN", 7, 60}; }, Grade::kWrong, "3 transactions wait for the journal, which is ada's", "pg_terminate_backend(7)"},
        Way{"transaction numbers", [](Facts* f) { f->database->oldest_xid_age = 1'900'000'000; }, Grade::kWrong, "95 % of the way", "vacuumdb"},
        Way{"schema behind", [](Facts* f) { f->database->schema_version = 14; }, Grade::kWrong, "version 14, this release knows 15", "sixpoint up"},
        Way{"schema ahead", [](Facts* f) { f->database->schema_version = 16; }, Grade::kWarning, "a newer release made it", "newer release's programs"},
        Way{"no schema", [](Facts* f) { f->database->record_why_not = "relation does not exist"; }, Grade::kWrong, "relation does not exist", "sixpoint up"},
        Way{"month missing", [](Facts* f) { f->database->months_ahead = -1; }, Grade::kWrong, "this month has no tables", "sixpoint storage partitions"},
        Way{"months end", [](Facts* f) { f->database->months_ahead = 0; }, Grade::kWarning, "made for 0 months ahead", "sixpoint storage partitions"},
        Way{"damage", [](Facts* f) { f->database->damage_count = 1; }, Grade::kWrong, "1 blob was found damaged", "sixpoint store status"},
        Way{"check late", [](Facts* f) { f->database->check_finished_at = f->now - hours(24 * 30); }, Grade::kWarning, "720 hours ago", "sixpoint store check"},
        Way{"retention", [](Facts* f) { f->database->overdue_scan_count = 5; }, Grade::kWarning, "5 scans are older than their policy", "retention apply"},
        Way{"dead rows", [](Facts* f) { f->database->bloated_table = "blobs"; f->database->bloated_part = 0.8; }, Grade::kWarning, "80 % of blobs", "VACUUM blobs"},
        Way{"settings", [](Facts* f) { f->settings_why_not = "plant.json: colour: unknown"; }, Grade::kWrong, "colour: unknown", "correct what is named"},
        Way{"plant elsewhere", [](Facts* f) { f->is_local = false; f->services_why_not = "connection refused"; }, Grade::kWrong, "connection refused", "on the plant's computer"}));

// What was not measured is said to be unknown, and is nobody's fault.
TEST(DoctorChecks, NothingKnownIsNotNothingWrong) {
  Facts facts;
  facts.is_local = true;
  facts.supervised = true;
  facts.watchdog_state = "RUNNING";
  int unknown = 0;
  for (const Finding& each : Judge(facts)) {
    EXPECT_TRUE(each.grade == Grade::kUnknown || each.check == "supervisor" || each.check == "watchdog" ||
                each.check == "ports")
        << each.check;
    unknown += each.grade == Grade::kUnknown ? 1 : 0;
  }
  EXPECT_GE(unknown, 3);
}

TEST(DoctorChecks, APlantThatIsDownIsOneFailure) {
  Facts facts = Healthy();
  facts.supervised = false;
  facts.database = Database();
  facts.database->why_not = "no such file";
  facts.restarts.reset();
  for (Service& service : facts.services) {
    service = Service{service.area,
                      service.address,
                      "NOT_REACHED",
                      "",
                      "",
                      {},
                      {},
                      {},
                      {},
                      {},
                      "",
                      {},
                      service.port,
                      {},
                      true,
                      {},
                      {},
                      {}};
  }
  int wrong = 0;
  for (const Finding& each : Judge(facts)) wrong += each.grade == Grade::kWrong ? 1 : 0;
  EXPECT_EQ(wrong, 1);
}

TEST(BytesText, IsShort) {
  EXPECT_EQ(BytesText(0), "0 bytes");
  EXPECT_EQ(BytesText(999), "999 bytes");
  EXPECT_EQ(BytesText(1.24e9), "1.2 GB");
  EXPECT_EQ(BytesText(5e17), "500 PB");
}

}  // namespace
}  // namespace sixpoint::cli::doctor
