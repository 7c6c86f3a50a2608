#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

#include "bench/ground/blade_rows.h"
#include "bench/ground/runs.h"
#include "bench/ground/transactions.h"
#include "storage/record.h"
#include "tests/support/registered.h"

namespace sixpoint::bench {
namespace {

using std::chrono::steady_clock;

constexpr int kFlushes = 300;
constexpr std::chrono::microseconds kBetweenLooks{200};
constexpr int kFeatures = 1000;

double MillisecondsSince(steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(steady_clock::now() - begin).count();
}

double Quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

// What the disk takes to have a page: the floor of any commit.
std::vector<double> TimeFlushes(const std::string& folder) {
  const std::string path = folder + "/flushed";
  const int file = open(path.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
  const std::vector<char> page(8192, 'x');
  std::vector<double> times;
  for (int i = 0; file >= 0 && i < kFlushes; ++i) {
    const auto begin = steady_clock::now();
    if (write(file, page.data(), page.size()) != static_cast<ssize_t>(page.size()) || fdatasync(file) != 0) break;
    times.push_back(MillisecondsSince(begin));
  }
  close(file);
  unlink(path.c_str());
  return times;
}

double OneCommitAfterAnother(storage::Database* database, double seconds) {
  {
    storage::Transaction transaction = Begin(database);
    Must(transaction.Execute("CREATE TABLE IF NOT EXISTS one_commit (id bigint)"));
    Commit(&transaction);
  }
  const auto begin = steady_clock::now();
  int count = 0;
  for (; MillisecondsSince(begin) < 1e3 * seconds; ++count) {
    storage::Transaction transaction = Begin(database);
    Must(transaction.Execute("INSERT INTO one_commit VALUES (1)"));
    Commit(&transaction);
  }
  return 1e3 * count / MillisecondsSince(begin);
}

// Who holds the journal's lock, asked every fifth of a millisecond: each holder from when it was first seen to when it was seen
// no more. One that came and went between two looks is missed; those are shorter than a look.
std::vector<double> WatchHolders(const std::string& conninfo, const std::atomic<bool>& going_on) {
  const auto database = storage::Database::Open(conninfo, 1);
  std::vector<double> holds;
  std::string holder;
  steady_clock::time_point since;
  storage::Transaction transaction = Begin(database.get());
  while (going_on) {
    const storage::Rows rows = Must(transaction.Execute(
        "SELECT virtualtransaction FROM pg_locks WHERE locktype = 'advisory' AND classid = 6021 AND objid = 1 "
        "AND objsubid = 2 AND granted"));
    const std::string now = rows.count() == 0 ? "" : rows.Text(0, 0);
    if (now == holder) {
      std::this_thread::sleep_for(kBetweenLooks);
      continue;
    }
    if (!holder.empty()) holds.push_back(MillisecondsSince(since));
    holder = now;
    since = steady_clock::now();
  }
  return holds;
}

// Blades, scans with their blocks, artefacts with as many features as are taken: small and large transactions side by side.
int Write(storage::Database* database, int writer, const std::atomic<bool>& going_on) {
  int count = 0;
  const std::string prefix = "load-" + std::to_string(getpid()) + "-" + std::to_string(writer) + "-";
  std::string serial;
  for (; going_on; ++count) {
    const std::string id = prefix + std::to_string(count);
    if (count % 4 == 0) {
      serial = id;
      AddBladeOnly(database, serial);
    } else if (count % 16 == 15) {
      storage::Transaction transaction = Begin(database);
      storage::ArtefactRow artefact = testing::ArtefactOf(id);
      for (int i = 0; i < kFeatures; ++i) artefact.features.push_back({"cone", "C" + std::to_string(i), 1.0 * i, 2});
      storage::RecordEntry entry;
      entry.software_version = "0.1.0+bench";
      Must(storage::InsertArtefact(transaction, artefact, entry));
      Commit(&transaction);
    } else {
      storage::Transaction transaction = Begin(database);
      AddScan(transaction, serial, id);
      Commit(&transaction);
    }
  }
  return count;
}

// Commits a second of so many writers of the mixed load.
double RateOf(storage::Database* database, int writer_count, double seconds) {
  static int run = 0;
  const int first = 100 * ++run;
  std::atomic<bool> going_on = true;
  std::atomic<int> count = 0;
  std::vector<std::thread> writers;
  const auto begin = steady_clock::now();
  for (int writer = 0; writer < writer_count; ++writer)
    writers.emplace_back([&, writer] { count += Write(database, first + writer, going_on); });
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  going_on = false;
  for (std::thread& writer : writers) writer.join();
  return 1e3 * count / MillisecondsSince(begin);
}

}  // namespace

nlohmann::json MeasureJournal(const std::string& conninfo, const std::string& folder, int writer_count,
                              double seconds) {
  const auto database = storage::Database::Open(conninfo, writer_count + 1);
  const std::vector<double> flushes = TimeFlushes(folder);
  const double rows = OneCommitAfterAnother(database.get(), seconds / 4);
  // Before and after: a disk is not the same from minute to minute.
  double one = RateOf(database.get(), 1, seconds / 2);
  std::atomic<bool> watching = true;
  std::vector<double> holds;
  std::thread watch([&] { holds = WatchHolders(conninfo, watching); });
  const double rate = RateOf(database.get(), writer_count, seconds);
  watching = false;
  watch.join();
  one = (one + RateOf(database.get(), 1, seconds / 2)) / 2;
  return {{"flush_p50_ms", Quantile(flushes, 0.5)},
          {"flush_p99_ms", Quantile(flushes, 0.99)},
          {"hold_p50_ms", Quantile(holds, 0.5)},
          {"hold_p99_ms", Quantile(holds, 0.99)},
          {"holds_seen", holds.size()},
          {"rows_per_s", rows},
          {"one_writer_per_s", one},
          {"writers_per_s", rate},
          {"over_one_writer", rate / one}};
}

nlohmann::json MeasureFrozenHolder(const std::string& conninfo) {
  int ready[2];
  if (pipe(ready) != 0) std::exit(1);
  const pid_t child = fork();
  if (child == 0) {
    const auto database = storage::Database::Open(conninfo, 1);
    storage::Transaction transaction = Begin(database.get());
    storage::RecordEntry entry;
    entry.kind = "scan";
    entry.name = "scans/frozen-" + std::to_string(getpid());
    entry.software_version = "0.1.0+bench";
    Must(storage::AppendRecord(transaction, storage::NewUuid(), entry));
    if (write(ready[1], "x", 1) != 1) _exit(1);
    raise(SIGSTOP);
    _exit(0);
  }
  char told = 0;
  if (read(ready[0], &told, 1) != 1) std::exit(1);
  const auto database = storage::Database::Open(conninfo, 1);
  const auto begin = steady_clock::now();
  AddBladeOnly(database.get(), "after-frozen-" + std::to_string(child));
  const double waited_s = MillisecondsSince(begin) / 1e3;
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  return {{"frozen_holder_s", waited_s}};
}

}  // namespace sixpoint::bench
