#include "bench/record/event_writers.h"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bench/ground/blade_rows.h"
#include "storage/plant_registry.h"

namespace sixpoint::bench {
namespace {

// Past its deadline a commit may have happened or not: the journal says.
bool Append(storage::Database* database, const std::string& serial) {
  absl::StatusOr<storage::Transaction> transaction =
      database->Begin(std::chrono::steady_clock::now() + std::chrono::seconds(5));
  if (!transaction.ok()) return false;
  storage::RecordEntry entry;
  entry.kind = "blade";
  entry.name = "blades/" + serial;
  entry.blade = serial;
  entry.inputs = {"parts/p1@1"};
  entry.software_version = "0.1.0+bench";
  entry.requested_by = "users/bench";
  return storage::InsertBlade(*transaction, {serial, "p1", {}}, entry).ok() && transaction->Commit().ok();
}

}  // namespace

void WriteEvents(const std::string& conninfo, int writer_count, int pause_ms) {
  const auto database = storage::Database::Open(conninfo, writer_count);
  MakeRegistry(database.get());
  std::printf("ready\n");
  std::fflush(stdout);
  std::atomic<bool> stopped{false};
  std::vector<std::vector<std::pair<std::string, double>>> acknowledged_s(static_cast<std::size_t>(writer_count));
  std::vector<std::thread> writers;
  for (int writer = 0; writer < writer_count; ++writer)
    writers.emplace_back([&, writer] {
      for (int i = 0; !stopped; ++i) {
        const std::string serial = "W" + std::to_string(writer) + "-" + std::to_string(i);
        const bool is_done = Append(database.get(), serial);
        const auto now = std::chrono::system_clock::now().time_since_epoch();
        if (is_done)
          acknowledged_s[static_cast<std::size_t>(writer)].emplace_back(serial,
                                                                        std::chrono::duration<double>(now).count());
        std::this_thread::sleep_for(std::chrono::milliseconds(is_done ? pause_ms : pause_ms + 100));
      }
    });
  char byte = 0;
  while (read(STDIN_FILENO, &byte, 1) > 0) continue;
  stopped = true;
  for (std::thread& each : writers) each.join();
  nlohmann::json told = nlohmann::json::object();
  for (const auto& of_writer : acknowledged_s)
    for (const auto& [serial, moment_s] : of_writer) told[serial] = moment_s;
  std::printf("%s\n", told.dump().c_str());
}

}  // namespace sixpoint::bench
