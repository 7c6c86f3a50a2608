// A real PostgreSQL for tests: one private server a test process (unix socket, own folder, checksums), one fresh database
// with every migration applied for each ThrowawayDatabase. The server ends with the process, whatever ends it.
#pragma once

#include <memory>
#include <string>

#include "storage/database.h"

namespace sixpoint::testing {

// Make one on the main thread (the server is tied to the thread that starts it). Not copyable.
class ThrowawayDatabase {
 public:
  enum class Schema { kMigrated, kEmpty };
  explicit ThrowawayDatabase(Schema schema = Schema::kMigrated);
  ThrowawayDatabase(const ThrowawayDatabase&) = delete;
  ThrowawayDatabase& operator=(const ThrowawayDatabase&) = delete;

  // For storage::Database::Open, storage::Migrate and --database.
  std::string conninfo() const { return conninfo_; }
  // A pool of its own, opened at the first call.
  storage::Database* database();
  std::unique_ptr<storage::Database> Open(int pool_size) const;

  // As a crash: no clean shutdown, recovery at the next start. All databases of the process go with it.
  static void KillServer();
  // Returns once connections are accepted again.
  static void StartServer();
  static std::string MigrationsFolder();

 private:
  std::string conninfo_;
  std::unique_ptr<storage::Database> database_;
};

// The same database as a service's role has it (migrations/V0010).
std::string AsRole(const std::string& conninfo, const std::string& area);

// A deadline for one test's statements.
storage::Deadline Soon(double seconds = 20);

}  // namespace sixpoint::testing
