#include "storage/migrate.h"

#include <libpq-fe.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <system_error>
#include <utility>
#include <vector>

#include "refusal/refusal.h"
#include "storage/blobs.h"
#include "storage/connection.h"

namespace sixpoint::storage {
namespace {

// Beside the journal's key; a session lock, so that two runners take turns.
constexpr char kLockMigrations[] = "SET lock_timeout = '30s'; SELECT pg_advisory_lock(6021, 2)";
constexpr char kCreateBookkeeping[] =
    "CREATE TABLE IF NOT EXISTS schema_migrations ("
    "version integer NOT NULL, name text NOT NULL, sha256 text NOT NULL, "
    "applied_at timestamptz NOT NULL DEFAULT clock_timestamp(), "
    "CONSTRAINT schema_migrations_pk PRIMARY KEY (version), CONSTRAINT schema_migrations_version_positive CHECK "
    "(version > 0))";
constexpr char kSelectApplied[] = "SELECT version, name, sha256 FROM schema_migrations ORDER BY version";
constexpr char kInsertApplied[] = "INSERT INTO schema_migrations (version, name, sha256) VALUES ($1, $2, $3)";
// A migration that would wait for a table's readers fails instead of holding up everyone behind it; run it again.
constexpr char kBeginFile[] = "BEGIN; SET LOCAL lock_timeout = '5s'; SET LOCAL statement_timeout = '10min'";
constexpr std::chrono::minutes kLongestFile{11};
// A plant that was away for months, or was restored, has none for this one.
constexpr char kMakeMonths[] =
    "DO $$ BEGIN IF to_regproc('make_partitions') IS NOT NULL THEN PERFORM make_partitions(3); END IF; END $$";

struct Migration {
  int version = 0;
  std::string name;
  std::string sql;
  std::string sha256;
};

absl::StatusOr<std::vector<Migration>> ReadFolder(const std::string& folder) {
  std::error_code error;
  std::vector<Migration> migrations;
  const std::regex form("V([0-9]{4})__[a-z0-9_]+\\.sql");
  for (std::filesystem::directory_iterator file(folder, error), end; !error && file != end; file.increment(error)) {
    const std::string name = file->path().filename().string();
    if (file->path().extension() != ".sql") continue;
    std::smatch match;
    if (!std::regex_match(name, match, form)) {
      return Refuse("migrations", name, "V0001__verb_object.sql");
    }
    std::ifstream stream(file->path(), std::ios::binary);
    Migration migration;
    migration.version = std::stoi(match[1]);
    migration.name = name;
    migration.sql.assign(std::istreambuf_iterator<char>(stream), {});
    if (stream.bad() || !stream.is_open()) return absl::NotFoundError("migrations: " + name + " cannot be read");
    migration.sha256 = Sha256Hex(migration.sql);
    migrations.push_back(std::move(migration));
  }
  if (error) return absl::NotFoundError("migrations: " + folder + ": " + error.message());
  std::sort(migrations.begin(), migrations.end(),
            [](const Migration& a, const Migration& b) { return a.version < b.version; });
  for (size_t i = 0; i < migrations.size(); ++i) {
    if (migrations[i].version != static_cast<int>(i) + 1) {
      return absl::FailedPreconditionError("migrations: " + migrations[i].name + " is number " + std::to_string(i + 1) +
                                           " in order, want numbers from 1 without gaps or repeats");
    }
  }
  if (migrations.empty()) return absl::NotFoundError("migrations: none in " + folder);
  return migrations;
}

Deadline Soon(std::chrono::seconds patience) { return std::chrono::steady_clock::now() + patience; }

// What the database says was applied, against what the files say now. Returns how many of the files are applied.
absl::StatusOr<size_t> CheckApplied(pg_conn* connection, const std::vector<Migration>& migrations) {
  absl::StatusOr<Result> result = Query(connection, kSelectApplied, nullptr, Soon(std::chrono::seconds(30)));
  if (!result.ok()) return result.status();
  const Rows applied(result->release());
  for (int row = 0; row < applied.count(); ++row) {
    const auto index = static_cast<size_t>(row);
    if (applied.Int(row, 0) != row + 1) {
      return absl::FailedPreconditionError("migrations: the database lacks version " + std::to_string(row + 1));
    }
    if (index >= migrations.size()) {
      return absl::FailedPreconditionError("migrations: the database has " + applied.Text(row, 1) +
                                           ", want a folder that has it too (a newer release made this database)");
    }
    if (applied.Text(row, 2) != migrations[index].sha256) {
      return absl::FailedPreconditionError("migrations: " + migrations[index].name +
                                           " has changed since it was applied as " + applied.Text(row, 1) +
                                           ", want the file as it was and a new migration");
    }
  }
  return applied.Checked(static_cast<size_t>(applied.count()));
}

absl::Status Apply(pg_conn* connection, const Migration& migration) {
  const Deadline deadline = Soon(kLongestFile);
  absl::StatusOr<Result> result = Query(connection, kBeginFile, nullptr, deadline);
  if (result.ok()) result = Query(connection, migration.sql, nullptr, deadline);
  if (result.ok() && PQtransactionStatus(connection) != PQTRANS_INTRANS) {
    return Refuse("migrations", migration.name + " ends its transaction", "none of BEGIN, COMMIT");
  }
  if (result.ok()) {
    const std::string version = std::to_string(migration.version);
    const WireParams params{{version.c_str(), migration.name.c_str(), migration.sha256.c_str()}, {0, 0, 0}, {0, 0, 0}};
    result = Query(connection, kInsertApplied, &params, deadline);
  }
  if (result.ok()) result = Query(connection, "COMMIT", nullptr, deadline);
  if (result.ok()) return absl::OkStatus();
  return absl::Status(result.status().code(), migration.name + ": " + std::string(result.status().message()));
}

}  // namespace

absl::StatusOr<int> Migrate(const std::string& conninfo, const std::string& migrations_folder) {
  const absl::StatusOr<std::vector<Migration>> migrations = ReadFolder(migrations_folder);
  if (!migrations.ok()) return migrations.status();
  const absl::StatusOr<Connection> connection = Connect(conninfo, Soon(std::chrono::seconds(5)));
  if (!connection.ok()) return connection.status();
  for (const char* sql : {kLockMigrations, kCreateBookkeeping}) {
    const absl::StatusOr<Result> prepared = Query(connection->get(), sql, nullptr, Soon(std::chrono::seconds(60)));
    if (!prepared.ok()) return prepared.status();
  }
  const absl::StatusOr<size_t> applied_count = CheckApplied(connection->get(), *migrations);
  if (!applied_count.ok()) return applied_count.status();
  for (size_t i = *applied_count; i < migrations->size(); ++i) {
    const absl::Status applied = Apply(connection->get(), (*migrations)[i]);
    if (!applied.ok()) return applied;
  }
  const absl::StatusOr<Result> months = Query(connection->get(), kMakeMonths, nullptr, Soon(kLongestFile));
  if (!months.ok()) return months.status();
  return static_cast<int>(migrations->size());  // closing the session gives the lock back
}

}  // namespace sixpoint::storage
