// Gauges that the database knows and no process alone: asked of it now and then, in a thread of their own, never by whoever looks.
#pragma once

#include <absl/status/status.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "storage/database.h"

namespace sixpoint::runtime {

class Sampled {
 public:
  virtual ~Sampled() = default;
  virtual absl::Status Read(storage::Transaction& transaction) = 0;
  // What was read is too old to be told.
  virtual void Forget() = 0;
};

// One thread, one connection while it asks.
class Sampler {
 public:
  // `database` lives longer.
  Sampler(storage::Database* database, std::vector<std::unique_ptr<Sampled>> sampled,
          std::chrono::milliseconds every = std::chrono::seconds(15));
  ~Sampler();
  Sampler(const Sampler&) = delete;
  Sampler& operator=(const Sampler&) = delete;

 private:
  void Run();

  storage::Database* const database_;
  const std::vector<std::unique_ptr<Sampled>> sampled_;
  const std::chrono::milliseconds every_;
  std::mutex mutex_;
  std::condition_variable stop_;
  bool stopped_ = false;
  std::thread thread_;
};

}  // namespace sixpoint::runtime
