#include <chrono>
#include <nlohmann/json.hpp>

#include "cli/doctor/gather.h"
#include "cli/last_words.h"
#include "cli/service_user.h"
#include "cli/subprocess.h"
#include "refusal/message_text.h"
#include "sixpoint/ingest/v1/store.grpc.pb.h"

namespace sixpoint::cli::doctor {
namespace {

using nlohmann::json;

constexpr char kServer[] =
    "SELECT json_build_object("
    "'version', current_setting('server_version_num')::int, "
    "'clock_us', (extract(epoch FROM clock_timestamp()) * 1e6)::bigint, "
    "'settings', (SELECT json_object_agg(name, setting) FROM pg_settings WHERE name IN "
    "('fsync', 'full_page_writes', 'synchronous_commit', 'data_checksums')), "
    "'connections', (SELECT count(*) FROM pg_stat_activity WHERE backend_type = 'client backend'), "
    "'limit', current_setting('max_connections')::int, "
    "'checksum_failures', (SELECT coalesce(sum(checksum_failures), 0) FROM pg_stat_database), "
    "'xid_age', (SELECT max(age(datfrozenxid)) FROM pg_database), "
    "'size', pg_database_size(current_database()))";
constexpr char kActivity[] =
    "SELECT json_build_object("
    "'slow', (SELECT coalesce(json_agg(q), '[]') FROM (SELECT usename AS user, pid, left(query, 200) AS query, "
    "extract(epoch FROM clock_timestamp() - query_start)::bigint AS seconds FROM pg_stat_activity "
    "WHERE state = 'active' AND backend_type = 'client backend' AND pid <> pg_backend_pid() "
    "AND clock_timestamp() - query_start > interval '10 s' ORDER BY 4 DESC LIMIT 20) q), "
    "'long', (SELECT coalesce(json_agg(q), '[]') FROM (SELECT usename AS user, pid, left(query, 200) AS query, "
    "extract(epoch FROM clock_timestamp() - xact_start)::bigint AS seconds FROM pg_stat_activity "
    "WHERE backend_type = 'client backend' AND pid <> pg_backend_pid() "
    "AND clock_timestamp() - xact_start > interval '1 min' ORDER BY 4 DESC LIMIT 20) q), "
    "'journal_waiters', (SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND classid = 6021 AND objid = 1 "
    "AND NOT granted), "
    "'journal_holder', (SELECT row_to_json(q) FROM (SELECT usename AS user, a.pid, left(query, 200) AS query, "
    "extract(epoch FROM clock_timestamp() - xact_start)::bigint AS seconds FROM pg_locks l "
    "JOIN pg_stat_activity a USING (pid) WHERE locktype = 'advisory' AND classid = 6021 AND objid = 1 AND granted "
    "LIMIT 1) q), "
    "'lock_waiters', (SELECT count(*) FROM pg_stat_activity WHERE wait_event_type = 'Lock'))";
constexpr char kRecord[] =
    "SELECT json_build_object("
    "'schema', (SELECT max(version) FROM schema_migrations), "
    "'months_ahead', (SELECT coalesce(min(m), 13) - 1 FROM generate_series(0, 12) m WHERE EXISTS (SELECT FROM "
    "partitioned_tables t WHERE to_regclass('public.' || partition_name(t.name, (date_trunc('month', "
    "clock_timestamp() AT TIME ZONE 'UTC') + make_interval(months => m))::date)) IS NULL)), "
    "'damages', (SELECT count(DISTINCT sha256) FROM blob_damages), "
    "'check', (SELECT row_to_json(p) FROM (SELECT extract(epoch FROM finished_at)::bigint AS finished, "
    "extract(epoch FROM begun_at)::bigint AS begun FROM blob_check_progress) p), "
    "'blobs', (SELECT count(*) FROM (SELECT FROM blobs LIMIT 1) b), "
    "'bloat', (SELECT row_to_json(q) FROM (SELECT relname AS table, n_dead_tup::float / (n_dead_tup + n_live_tup) "
    "AS part FROM pg_stat_user_tables WHERE n_dead_tup + n_live_tup > 100000 ORDER BY 2 DESC LIMIT 1) q))";
// Beyond the two days that the keeper may have been away. As the keeper asks, from where its work has come to.
constexpr char kOverdue[] =
    "SELECT json_build_object('overdue', (SELECT count(*) FROM (SELECT FROM retention_policies p JOIN scans s ON "
    "s.kind = "
    "p.scan_kind LEFT JOIN retention_progress g ON g.scan_kind = p.scan_kind AND g.policy_revision = p.revision "
    "WHERE p.keep_days IS NOT NULL AND NOT EXISTS (SELECT FROM retention_policies q WHERE q.scan_kind = p.scan_kind "
    "AND q.revision > p.revision) AND s.scan_key > coalesce(g.after_scan_key, "
    "'00000000-0000-0000-0000-000000000000') AND s.scan_key < least_uuid_of(now() - make_interval(days => p.keep_days "
    "+ 2)) AND NOT EXISTS (SELECT FROM scan_deletions d WHERE d.scan_key = s.scan_key) LIMIT 100000) q))";

struct Answer {
  json value;
  std::string why_not;
};

// By a program of its own, which ends whatever becomes of the server: no connection of ours is left behind.
Answer Ask(const LocalPlant& plant, const char* sql) {
  const std::vector<std::string> psql = {"timeout",
                                         "--kill-after=1",
                                         "6",
                                         "env",
                                         "PGCONNECT_TIMEOUT=3",
                                         "PGOPTIONS=-c statement_timeout=4s -c lock_timeout=2s "
                                         "-c default_transaction_read_only=on",
                                         std::string(kPostgresBin) + "psql",
                                         "-XAtq",
                                         "-v",
                                         "ON_ERROR_STOP=1",
                                         "-h",
                                         plant.sockets().string(),
                                         "-U",
                                         "sixpoint",
                                         "-d",
                                         "sixpoint",
                                         "-c",
                                         sql};
  const Finished finished = RunProgram(AsServiceUser(psql));
  if (finished.exit_code == 124 || finished.exit_code == 137) return {nullptr, "no answer within 6 s"};
  Answer answer;
  if (finished.exit_code != 0) {
    answer.why_not = Tame(LastWordsOf(finished.output), 300);
    if (answer.why_not.empty()) answer.why_not = "psql ended with " + std::to_string(finished.exit_code);
    return answer;
  }
  answer.value = json::parse(finished.output, nullptr, false);
  if (!answer.value.is_object()) answer.why_not = "an answer that cannot be read";
  return answer;
}

std::int64_t Number(const json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_number() ? found->get<std::int64_t>() : 0;
}

Statement StatementOf(const json& row) {
  const auto text = [&](const char* name) {
    const auto found = row.find(name);
    return found != row.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  return {text("user"), text("query"), Number(row, "pid"), Number(row, "seconds")};
}

std::vector<Statement> StatementsOf(const json& rows) {
  std::vector<Statement> statements;
  for (const json& row : rows)
    if (row.is_object()) statements.push_back(StatementOf(row));
  return statements;
}

std::optional<Time> TimeAt(const json& object, const char* name) {
  const std::int64_t seconds = Number(object, name);
  if (seconds == 0) return std::nullopt;
  return Time(std::chrono::seconds(seconds));
}

void ReadServer(const json& server, Time before, Time after, Database* database) {
  database->version_number = static_cast<int>(Number(server, "version"));
  const json settings = server.value("settings", json::object());
  for (const auto& [name, value] : settings.items())
    if (value.is_string()) database->settings[name] = value.get<std::string>();
  database->connection_count = static_cast<int>(Number(server, "connections"));
  database->connection_limit = static_cast<int>(Number(server, "limit"));
  database->checksum_failure_count = Number(server, "checksum_failures");
  database->oldest_xid_age = Number(server, "xid_age");
  database->size_bytes = Number(server, "size");
  const Time theirs{std::chrono::microseconds(Number(server, "clock_us"))};
  const auto seconds = [](auto duration) { return std::chrono::duration<double>(duration).count(); };
  database->clock_doubt_s = seconds(after - before) / 2;
  database->clock_ahead_s = seconds(theirs - before) - *database->clock_doubt_s;
}

void ReadRecord(const json& record, Database* database) {
  if (record.contains("schema") && record["schema"].is_number())
    database->schema_version = static_cast<int>(Number(record, "schema"));
  database->months_ahead = static_cast<int>(Number(record, "months_ahead"));
  database->damage_count = Number(record, "damages");
  database->blob_count = Number(record, "blobs");
  if (const auto check = record.find("check"); check != record.end() && check->is_object()) {
    database->check_finished_at = TimeAt(*check, "finished");
    database->check_begun_at = TimeAt(*check, "begun");
  }
  if (const auto bloat = record.find("bloat"); bloat != record.end() && bloat->is_object()) {
    database->bloated_table = bloat->value("table", "");
    database->bloated_part = bloat->value("part", 0.0);
  }
}

}  // namespace

Database GatherDatabase(const LocalPlant& plant) {
  Database database;
  const Time before = std::chrono::system_clock::now();
  const Answer server = Ask(plant, kServer);
  const Time after = std::chrono::system_clock::now();
  database.why_not = server.why_not;
  if (!database.why_not.empty()) return database;
  ReadServer(server.value, before, after, &database);
  const Answer activity = Ask(plant, kActivity);
  database.activity_why_not = activity.why_not;
  if (activity.value.is_object()) {
    database.slow = StatementsOf(activity.value["slow"]);
    database.long_transactions = StatementsOf(activity.value["long"]);
    database.journal_waiter_count = static_cast<int>(Number(activity.value, "journal_waiters"));
    database.lock_waiter_count = static_cast<int>(Number(activity.value, "lock_waiters"));
    if (activity.value["journal_holder"].is_object())
      database.journal_holder = StatementOf(activity.value["journal_holder"]);
  }
  const Answer record = Ask(plant, kRecord);
  database.record_why_not = record.why_not;
  if (record.value.is_object()) ReadRecord(record.value, &database);
  if (const Answer overdue = Ask(plant, kOverdue); overdue.value.is_object())
    database.overdue_scan_count = Number(overdue.value, "overdue");
  return database;
}

Database AskStore(Session* session) {
  namespace v1 = ingest::v1;
  Database database;
  v1::StoreStatus status;
  const absl::Status asked = session->Call<v1::CloudStoreService>(
      "ingest", &v1::CloudStoreService::Stub::GetStoreStatus, v1::GetStoreStatusRequest(), &status);
  if (!asked.ok()) {
    database.record_why_not = std::string(asked.message());
    return database;
  }
  database.damage_count = status.damages_size();
  database.blob_count = 0;
  for (const v1::HolderUse& use : status.uses()) *database.blob_count += use.kept_count();
  if (status.has_check_finished_at())
    database.check_finished_at = Time(std::chrono::seconds(status.check_finished_at().seconds()));
  if (status.has_check_begun_at())
    database.check_begun_at = Time(std::chrono::seconds(status.check_begun_at().seconds()));
  return database;
}

}  // namespace sixpoint::cli::doctor
