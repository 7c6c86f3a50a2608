#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cli/doctor/checks.h"
#include "refusal/message_text.h"

namespace sixpoint::cli::doctor {
namespace {

constexpr int kOldestPostgres = 150000;
constexpr double kManyConnections = 0.8;
// autovacuum freezes at 200 million; the server refuses to write at 2 billion.
constexpr std::int64_t kOldXid = 1'000'000'000, kDangerousXid = 1'800'000'000;
constexpr double kBloated = 0.5;
constexpr std::chrono::hours kLongestBetweenChecks{24 * 8};
constexpr int kFewMonths = 1;

std::string Count(std::int64_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::string Of(const Statement& statement) {
  return statement.user + "'s for " + std::to_string(statement.seconds) + " s (pid " + std::to_string(statement.pid) +
         "): " + Tame(statement.query, 80);
}

std::string ReleaseText(int version_number) {
  return std::to_string(version_number / 10000) + "." + std::to_string(version_number % 10000);
}

void JudgeSettings(const Database& database, Findings* findings) {
  std::string off;
  for (const char* name : {"fsync", "full_page_writes", "synchronous_commit"})
    if (const auto found = database.settings.find(name); found != database.settings.end() && found->second == "off")
      off += (off.empty() ? "" : ", ") + std::string(name);
  const std::string first = off.substr(0, off.find(','));
  findings->push_back(
      {"PostgreSQL: durable", off.empty() ? Grade::kOk : Grade::kWrong,
       off.empty() ? "what it has kept survives a power cut" : off + " off: what was acknowledged may be lost",
       off.empty() ? "" : "ALTER SYSTEM RESET " + first + "; then SELECT pg_reload_conf()"});
  if (const auto found = database.settings.find("data_checksums");
      found != database.settings.end() && found->second != "on")
    findings->push_back({"PostgreSQL: checksums", Grade::kWarning,
                         "its files have no checksums: damage of the disk is found late or never",
                         "while the plant is down: pg_checksums --enable"});
  if (database.checksum_failure_count > 0)
    findings->push_back({"PostgreSQL: checksums", Grade::kWrong,
                         Count(database.checksum_failure_count, "damaged page was", "damaged pages were") + " read",
                         "replace the disk and restore from the last backup; do not go on writing"});
}

void JudgeClock(const Database& database, Findings* findings) {
  if (!database.clock_ahead_s) return;
  const double apart_s = std::max(0.0, std::abs(*database.clock_ahead_s) - database.clock_doubt_s.value_or(0));
  char text[100];
  std::snprintf(text, sizeof text, "%.3g s %s ours", std::abs(*database.clock_ahead_s),
                *database.clock_ahead_s >= 0 ? "ahead of" : "behind");
  if (apart_s <= kClockApart_s) {
    findings->push_back({"PostgreSQL: clock", Grade::kOk, "agrees with ours", ""});
    return;
  }
  findings->push_back({"PostgreSQL: clock", apart_s > kClockFarApart_s ? Grade::kWrong : Grade::kWarning, text,
                       "have both computers' clocks kept by one time service"});
}

void JudgeLoad(const Database& database, Findings* findings) {
  const double used = database.connection_limit > 0 ? double(database.connection_count) / database.connection_limit : 0;
  findings->push_back(
      {"PostgreSQL: connections",
       used >= 1                  ? Grade::kWrong
       : used >= kManyConnections ? Grade::kWarning
                                  : Grade::kOk,
       std::to_string(database.connection_count) + " of " + std::to_string(database.connection_limit) + " in use",
       used >= kManyConnections ? "see whose: SELECT usename, count(*) FROM pg_stat_activity GROUP BY 1" : ""});
  const double xid_part = static_cast<double>(database.oldest_xid_age) / 2e9;
  char xid[120];
  std::snprintf(xid, sizeof xid, "the oldest transaction number is %.0f %% of the way to where writing ends",
                100 * xid_part);
  const bool is_old = database.oldest_xid_age > kOldXid;
  findings->push_back({"PostgreSQL: transaction numbers",
                       database.oldest_xid_age > kDangerousXid ? Grade::kWrong
                       : is_old                                ? Grade::kWarning
                                                               : Grade::kOk,
                       xid, is_old ? "end long transactions, and let it run: vacuumdb --all --freeze" : ""});
}

void JudgeActivity(const Database& database, Findings* findings) {
  if (!database.activity_why_not.empty()) {
    findings->push_back({"PostgreSQL: at work", Grade::kUnknown, database.activity_why_not, ""});
    return;
  }
  const auto judge = [&](const std::string& name, const std::vector<Statement>& statements, const std::string& none,
                         const std::string& some) {
    findings->push_back(
        {name, statements.empty() ? Grade::kOk : Grade::kWarning,
         statements.empty() ? none
                            : std::to_string(statements.size()) + some + ", the oldest is " + Of(statements.front()),
         statements.empty()
             ? ""
             : "if it is nobody's wish: SELECT pg_cancel_backend(" + std::to_string(statements.front().pid) + ")"});
  };
  judge("PostgreSQL: slow statements", database.slow, "none runs for more than 10 s", " run for more than 10 s");
  judge("PostgreSQL: long transactions", database.long_transactions, "none is open for more than a minute",
        " open for more than a minute");
  const bool waits = database.journal_waiter_count > 0;
  std::string words = "nobody waits for the journal";
  if (waits) {
    words = Count(database.journal_waiter_count, "transaction waits", "transactions wait") + " for the journal";
    if (database.journal_holder) words += ", which is " + Of(*database.journal_holder);
  } else if (database.lock_waiter_count > 0) {
    words += "; " + Count(database.lock_waiter_count, "transaction waits", "transactions wait") + " for other locks";
  }
  const bool holds_long = database.journal_holder && database.journal_holder->seconds > 10;
  findings->push_back({"PostgreSQL: journal",
                       waits && holds_long ? Grade::kWrong
                       : waits             ? Grade::kWarning
                                           : Grade::kOk,
                       words,
                       waits && database.journal_holder
                           ? "a service loses it after 8 s; of a person's: SELECT pg_terminate_backend(" +
                                 std::to_string(database.journal_holder->pid) + ")"
                       : waits ? "look again in a few seconds; then: sixpoint logs postgres --since 10m"
                               : ""});
}

void JudgeMonths(const Database& database, Findings* findings) {
  if (!database.months_ahead) return;
  const int ahead = *database.months_ahead;
  const std::string make = "sixpoint storage partitions --months-ahead 3";
  if (ahead < 0) {
    findings->push_back({"months", Grade::kWrong, "this month has no tables: nothing can be recorded", make});
  } else {
    findings->push_back(
        {"months", ahead < kFewMonths ? Grade::kWarning : Grade::kOk,
         ahead >= 12 ? "made for a year ahead and more" : "made for " + Count(ahead, "month", "months") + " ahead",
         ahead < kFewMonths ? make : ""});
  }
}

void JudgeStore(const Facts& facts, const Database& database, Findings* findings) {
  if (database.damage_count)
    findings->push_back(
        {"store: damage", *database.damage_count > 0 ? Grade::kWrong : Grade::kOk,
         *database.damage_count > 0 ? Count(*database.damage_count, "blob was", "blobs were") + " found damaged"
                                    : "none found",
         *database.damage_count > 0 ? "sixpoint store status names them; restore them from a backup" : ""});
  if (database.blob_count.value_or(0) == 0) {
    findings->push_back({"store: check", Grade::kOk, "nothing is stored yet", ""});
  } else if (!database.check_finished_at) {
    const bool is_late = database.check_begun_at && facts.now - *database.check_begun_at > kLongestBetweenChecks;
    findings->push_back(
        {"store: check", is_late ? Grade::kWarning : Grade::kOk,
         is_late ? "no pass over all blobs has ended in more than eight days"
                 : "its first pass over all blobs is under way",
         is_late ? "let it read faster: sixpoint-ingest --check-mb-s, or once: sixpoint store check" : ""});
  } else {
    const auto hours = std::chrono::duration_cast<std::chrono::hours>(facts.now - *database.check_finished_at).count();
    const bool is_late = facts.now - *database.check_finished_at > kLongestBetweenChecks;
    findings->push_back(
        {"store: check", is_late ? Grade::kWarning : Grade::kOk,
         "every blob was read again " + Count(std::max<long>(hours, 0), "hour", "hours") + " ago",
         is_late ? "see why: sixpoint logs ingest --since 1d --level warning; by hand: sixpoint store check" : ""});
  }
  if (database.overdue_scan_count)
    findings->push_back({"store: retention", *database.overdue_scan_count > 0 ? Grade::kWarning : Grade::kOk,
                         *database.overdue_scan_count > 0
                             ? Count(*database.overdue_scan_count, "scan is", "scans are") +
                                   " older than their policy by more than two days"
                             : "nothing is kept longer than its policy says",
                         *database.overdue_scan_count > 0 ? "sixpoint store retention apply" : ""});
}

}  // namespace

void JudgeDatabase(const Facts& facts, Findings* findings) {
  if (!facts.database) return;
  const Database& database = *facts.database;
  if (!database.why_not.empty()) {
    findings->push_back({"PostgreSQL", facts.supervised ? Grade::kWrong : Grade::kUnknown,
                         facts.supervised ? "does not answer: " + database.why_not : "does not run",
                         facts.supervised ? "sixpoint logs postgres --since 10m; then: sixpoint up" : ""});
    return;
  }
  const bool is_old = database.version_number < kOldestPostgres;
  findings->push_back({"PostgreSQL", is_old ? Grade::kWrong : Grade::kOk,
                       "version " + ReleaseText(database.version_number) + (is_old ? ", want 15 or newer" : "") + ", " +
                           BytesText(static_cast<double>(database.size_bytes)),
                       is_old ? "move the database to PostgreSQL 15: pg_upgrade" : ""});
  JudgeSettings(database, findings);
  JudgeClock(database, findings);
  JudgeLoad(database, findings);
  JudgeActivity(database, findings);
}

void JudgeRecord(const Facts& facts, Findings* findings) {
  if (facts.store) {
    if (facts.store->record_why_not.empty())
      JudgeStore(facts, *facts.store, findings);
    else
      findings->push_back({"store", Grade::kUnknown, "it does not tell us: " + facts.store->record_why_not, ""});
  }
  if (!facts.database || !facts.database->why_not.empty()) return;
  const Database& database = *facts.database;
  if (!database.record_why_not.empty()) {
    findings->push_back({"record", Grade::kWrong, "its tables cannot be asked: " + database.record_why_not,
                         "sixpoint up brings the schema up to date"});
    return;
  }
  if (database.schema_version) {
    const int version = *database.schema_version, newest = facts.newest_migration;
    const std::string words = "version " + std::to_string(version) + ", this release knows " + std::to_string(newest);
    findings->push_back(
        {"schema",
         version < newest   ? Grade::kWrong
         : version > newest ? Grade::kWarning
                            : Grade::kOk,
         version == newest ? words
                           : words + (version < newest ? ": services of it do not serve" : ": a newer release made it"),
         version < newest   ? "sixpoint up"
         : version > newest ? "run the newer release's programs, or leave them as they are while it changes over"
                            : ""});
  }
  JudgeMonths(database, findings);
  JudgeStore(facts, database, findings);
  if (!database.bloated_table.empty())
    findings->push_back({"PostgreSQL: dead rows", database.bloated_part > kBloated ? Grade::kWarning : Grade::kOk,
                         std::to_string(std::lround(100 * database.bloated_part)) + " % of " + database.bloated_table,
                         database.bloated_part > kBloated ? "VACUUM " + database.bloated_table : ""});
}

}  // namespace sixpoint::cli::doctor
