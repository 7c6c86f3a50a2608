// sixpoint-migrate: brings a database's schema to the newest migration.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>

#include "storage/migrate.h"

int main(int argc, char** argv) {
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
