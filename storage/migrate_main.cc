// sixpoint-migrate: brings a database's schema to the newest migration. And, `--run-without FOLDER... --writing FOLDER... -- COMMAND`:
// becomes that command (PostgreSQL), which opens nothing in the first folders and changes nothing outside of the second, although its
// user could: what a superuser of the database has it do reads no key that lies there.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <string>
#include <thread>

#include "sandbox/landlock.h"
#include "storage/migrate.h"

namespace {

constexpr char kRunWithout[] = "--run-without";

// --run-without FOLDER... --writing FOLDER... -- COMMAND WORD...
int RunWithout(int argc, char** argv) {
  std::vector<std::filesystem::path> hidden, writable;
  auto* folders = &hidden;
  int at = 2;
  for (; at < argc && std::strcmp(argv[at], "--") != 0; ++at) {
    if (std::strcmp(argv[at], "--writing") == 0)
      folders = &writable;
    else
      folders->emplace_back(argv[at]);
  }
  if (hidden.empty() || at + 1 >= argc) {
    std::fprintf(stderr,
                 "sixpoint-migrate: %s: no folder or no command, want %s FOLDER... --writing FOLDER... -- COMMAND\n",
                 kRunWithout, kRunWithout);
    return 2;
  }
  if (sixpoint::sandbox::LandlockVersion() == 0)
    std::fprintf(stderr, "sixpoint-migrate: this kernel has no Landlock: %s reads and writes what its user can\n",
                 argv[at + 1]);
  if (sixpoint::sandbox::GiveUpFolders(hidden, writable)) execv(argv[at + 1], argv + at + 1);
  std::fprintf(stderr, "sixpoint-migrate: %s: %s\n", argv[at + 1], std::strerror(errno));
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::strcmp(argv[1], kRunWithout) == 0) return RunWithout(argc, argv);
  std::string conninfo, folder;
  double wait_s = 30;
  CLI::App app("Applies the missing migrations, each in one transaction.", "sixpoint-migrate");
  app.add_option("--database", conninfo, "Connection string, as libpq takes it")->required();
  app.add_option("--migrations", folder, "Folder of V0001__verb_object.sql, ...")->required();
  app.add_option("--wait-s", wait_s, "How long to wait for a server that is still starting")->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  const auto give_up = std::chrono::steady_clock::now() + std::chrono::duration<double>(wait_s);
  for (;;) {
    const absl::StatusOr<int> version = sixpoint::storage::Migrate(conninfo, folder);
    if (version.ok()) {
      std::printf("schema version %d\n", *version);
      return 0;
    }
    const bool may_come = version.status().code() == absl::StatusCode::kUnavailable ||
                          version.status().code() == absl::StatusCode::kDeadlineExceeded;
    if (!may_come || std::chrono::steady_clock::now() >= give_up) {
      std::fprintf(stderr, "sixpoint-migrate: %s\n", version.status().ToString().c_str());
      return 1;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
  }
}
