#include "tests/support/throwaway_database.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <thread>
#include <vector>

#include "storage/migrate.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
constexpr char kTemplate[] = "sixpoint_template";

[[noreturn]] void Fail(const std::string& message) {
  std::fprintf(stderr, "throwaway database: %s\n", message.c_str());
  std::exit(1);
}

// The newest server that Debian's packages installed.
std::string BinFolder() {
  std::vector<std::string> folders;
  std::error_code none;
  for (const fs::directory_entry& version : fs::directory_iterator("/usr/lib/postgresql", none)) {
    if (fs::exists(version.path() / "bin" / "initdb")) folders.push_back(version.path() / "bin");
  }
  if (folders.empty()) Fail("no PostgreSQL under /usr/lib/postgresql, want the package postgresql-15");
  return *std::max_element(folders.begin(), folders.end());
}

// PostgreSQL refuses to run as root. Its end is tied to ours, also when we are killed.
std::vector<std::string> AsServerUser(std::vector<std::string> command) {
  std::vector<std::string> whole = {"setpriv", "--pdeathsig", "QUIT"};
  if (geteuid() == 0) whole.insert(whole.end(), {"--reuid=postgres", "--regid=postgres", "--clear-groups"});
  whole.insert(whole.end(), command.begin(), command.end());
  return whole;
}

pid_t Spawn(const std::vector<std::string>& command, const std::string& log_file) {
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  const pid_t child = fork();
  if (child < 0) Fail("cannot fork");
  if (child == 0) {
    FILE* log = std::freopen(log_file.c_str(), "a", stdout);
    if (log == nullptr || dup2(fileno(stdout), 2) < 0 || chdir("/") != 0) _exit(126);
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  return child;
}

class Server {
 public:
  Server() {
    std::string pattern = (fs::temp_directory_path() / "sixpoint-test-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) Fail("cannot make " + pattern);
    folder_ = pattern;
    log_file_ = folder_ + "/log";
    // The log is opened by us, the rest belongs to the server's user.
    fs::create_directory(folder_ + "/run");
    if (geteuid() == 0) {
      const std::string own = "chown postgres " + folder_ + " " + folder_ + "/run";
      if (std::system(own.c_str()) != 0) Fail(own);
    }
    int status = 0;
    const pid_t child = Spawn(AsServerUser({BinFolder() + "/initdb", "-D", folder_ + "/data", "-U", "sixpoint", "-A",
                                            "trust", "--data-checksums", "--no-sync", "--encoding=UTF8", "--locale=C"}),
                              log_file_);
    if (waitpid(child, &status, 0) != child || status != 0) Fail("initdb failed, see " + log_file_);
    Start();
    const absl::StatusOr<storage::Rows> made = Administer(std::string("CREATE DATABASE ") + kTemplate);
    if (!made.ok()) Fail(made.status().ToString());
    const absl::StatusOr<int> migrated = storage::Migrate(ConninfoOf(kTemplate), ThrowawayDatabase::MigrationsFolder());
    if (!migrated.ok()) Fail(migrated.status().ToString());
  }

  ~Server() {
    Kill();
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }

  void Start() {
    // What is thrown away need not be flushed; services that are started from here serve it all the same.
    setenv("SIXPOINT_VOLATILE_DATABASE", "true", 1);
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(40);
    while (std::chrono::steady_clock::now() < give_up) {
      // After a crash a start is refused until the dead server's last processes have gone.
      if (pid_ <= 0 || waitpid(pid_, nullptr, WNOHANG) == pid_) {
        pid_ = Spawn(AsServerUser({BinFolder() + "/postgres", "-D", folder_ + "/data", "-k", folder_ + "/run", "-c",
                                   "listen_addresses=", "-c", "fsync=off", "-c", "shared_buffers=32MB", "-c",
                                   "max_connections=60"}),
                     log_file_);
      }
      if (Administer("SELECT 1").ok()) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    Fail("the server does not start, see " + log_file_);
  }

  void Kill() {
    if (pid_ <= 0) return;
    kill(pid_, SIGQUIT);  // immediate shutdown: as pg_ctl stop -m immediate
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

  std::string ConninfoOf(const std::string& database) const {
    return "host=" + folder_ + "/run user=sixpoint dbname=" + database;
  }

  // A statement that may not run inside a transaction block: ended by hand before it and begun after it.
  absl::StatusOr<storage::Rows> Administer(const std::string& sql) const {
    const auto database = storage::Database::Open(ConninfoOf("postgres"), 1);
    absl::StatusOr<storage::Transaction> transaction = database->Begin(Soon(30));
    if (!transaction.ok()) return transaction.status();
    const absl::StatusOr<storage::Rows> ended = transaction->Execute("ROLLBACK");
    if (!ended.ok()) return ended.status();
    return transaction->Execute(sql);
  }

 private:
  std::string folder_, log_file_;
  pid_t pid_ = 0;
};

Server& TheServer() {
  static Server server;  // its destructor stops it
  return server;
}

}  // namespace

storage::Deadline Soon(double seconds) {
  return std::chrono::steady_clock::now() + std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1e3));
}

std::string AsRole(const std::string& conninfo, const std::string& area) { return conninfo + " user=sixpoint_" + area; }

ThrowawayDatabase::ThrowawayDatabase(Schema schema) {
  static int number = 0;
  const std::string name = "test_" + std::to_string(++number);
  const absl::StatusOr<storage::Rows> made = TheServer().Administer(
      "CREATE DATABASE " + name + (schema == Schema::kMigrated ? std::string(" TEMPLATE ") + kTemplate : ""));
  if (!made.ok()) Fail(made.status().ToString());
  conninfo_ = TheServer().ConninfoOf(name);
}

storage::Database* ThrowawayDatabase::database() {
  if (database_ == nullptr) database_ = Open(8);
  return database_.get();
}

std::unique_ptr<storage::Database> ThrowawayDatabase::Open(int pool_size) const {
  return storage::Database::Open(conninfo_, pool_size);
}

void ThrowawayDatabase::KillServer() { TheServer().Kill(); }
void ThrowawayDatabase::StartServer() { TheServer().Start(); }

std::string ThrowawayDatabase::MigrationsFolder() {
  const char* source = std::getenv("SIXPOINT_SOURCE_DIR");
  if (source == nullptr) Fail("SIXPOINT_SOURCE_DIR is not set, want the repository's root (ctest sets it)");
  return std::string(source) + "/migrations";
}

}  // namespace sixpoint::testing
