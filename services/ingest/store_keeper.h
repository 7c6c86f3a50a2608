// Keeps the store in the background, beside the calls: months ahead of time, retention and collection now and then, a slow check all
// the time.
#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "storage/blob_store.h"

namespace sixpoint::ingest {

struct StoreKeeperOptions {
  std::chrono::seconds every{3600};                            // retention and collection; 0: never
  std::chrono::seconds grace{24 * 3600};                       // of the collector
  std::chrono::seconds unfinished_upload_patience{24 * 3600};  // since its last block
  double check_rate_mb_s = 5;                                  // 0: no check
  std::chrono::seconds between_checks{24 * 3600};              // from the end of one pass to the next
};

// One thread and one database connection of its own, so that calls never wait for it.
class StoreKeeper {
 public:
  StoreKeeper(const StoreKeeperOptions& options, const std::string& conninfo,
              std::shared_ptr<storage::BlobStore> store);
  // Within about a second: what runs is left at its next step.
  ~StoreKeeper();

 private:
  void Run();
  void Tidy();
  void KeepMonths();
  absl::Status ForgetUnfinished();
  absl::Status AddUpUse();
  void CheckSome();
  bool Ready();
  bool KeepGoing();

  const StoreKeeperOptions options_;
  const std::unique_ptr<storage::Database> database_;
  const std::shared_ptr<storage::BlobStore> store_;
  std::mutex mutex_;
  std::condition_variable stopped_;
  bool stopping_ = false;
  std::chrono::steady_clock::time_point next_tidy_;
  std::chrono::steady_clock::time_point next_months_;  // at once
  std::thread thread_;
};

}  // namespace sixpoint::ingest
