// Seals what was recorded, behind the writes: a leaf for each entry of the journal, now and then a head that is signed and sent out. It
// signs nothing that contradicts the last head that it sent out, whatever the database says.
#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "ledger/head.h"
#include "storage/ledger_store.h"

namespace sixpoint::plant {

struct LedgerSealerOptions {
  std::chrono::milliseconds every{5000};        // between looks for what is not sealed
  std::chrono::milliseconds head_every{60000};  // at most one head in that time, where anything is new
  std::string heads_file;                       // where heads are sent out: a line each; empty: nowhere
};

// One thread of its own, which never holds the journal's lock.
class LedgerSealer {
 public:
  // ledger: one by a connection of its own, so that calls never wait for it. key: none: entries are sealed, and no head is signed.
  LedgerSealer(LedgerSealerOptions options, std::shared_ptr<storage::LedgerStore> ledger,
               std::optional<ledger::SigningKey> key);
  // Within about a second.
  ~LedgerSealer();

  // What the thread does, once each; for tests, too.
  absl::Status SealAll();
  // NOT_FOUND where nothing is sealed; FAILED_PRECONDITION where what was sealed contradicts the last head.
  absl::Status SignHead();

 private:
  void Run();
  bool Ready();
  bool KeepGoing();
  absl::Status CheckAgainst(const ledger::Head& last, std::int64_t size, storage::Deadline deadline);

  const LedgerSealerOptions options_;
  const std::shared_ptr<storage::LedgerStore> ledger_;
  const std::optional<ledger::SigningKey> key_;
  std::mutex mutex_;
  std::condition_variable stopped_;
  bool stopping_ = false;
  std::chrono::steady_clock::time_point next_head_;
  std::string last_failure_;
  std::thread thread_;
};

}  // namespace sixpoint::plant
