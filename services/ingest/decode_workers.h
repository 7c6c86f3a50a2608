// A small pool of sixpoint-decode-worker processes. A worker that refuses a block, dies, or takes too long is replaced: after
// bytes that it did not like its memory is not trusted further.
#pragma once

#include <absl/status/statusor.h>
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "services/ingest/block_statistics.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/metrics.h"

namespace sixpoint::ingest {

// What a worker found of a block.
struct CheckedBlock {
  BlockStatistics statistics;
  // The same points, to the last bit, as our own encoder writes them: all that any other process decodes. Empty where that is
  // the payload itself.
  std::string reencoded;
};

// Thread-safe.
class DecodeWorkers {
 public:
  // `program`: path of sixpoint-decode-worker. `patience`: greatest time for one block. Workers start when first needed.
  DecodeWorkers(std::string program, int worker_count, std::chrono::milliseconds patience);
  ~DecodeWorkers();
  DecodeWorkers(const DecodeWorkers&) = delete;
  DecodeWorkers& operator=(const DecodeWorkers&) = delete;

  // How long a block may wait for a worker and for its decoding.
  struct Caller {
    std::chrono::steady_clock::time_point deadline;
    std::function<bool()> keep_going;  // may be empty
  };
  // Decodes in a worker. INVALID_ARGUMENT: the block is not what it should be; the message says what is wrong with it.
  // DEADLINE_EXCEEDED: no worker became free, or the caller's time ended; CANCELLED: it went away while it waited.
  // UNAVAILABLE: no worker can be started, or it could not confine itself.
  absl::StatusOr<CheckedBlock> Check(std::string_view payload, std::int64_t point_count, double profile_pitch_mm,
                                     const ProfileCursor& begin, const Caller& caller);

  // How many were started so far.
  int started_count() const { return started_count_; }

 private:
  struct Worker {
    pid_t pid = -1;
    int socket = -1;
  };
  absl::StatusOr<CheckedBlock> CheckOnce(std::string_view payload, std::int64_t point_count, double profile_pitch_mm,
                                         const ProfileCursor& begin, const Caller& caller);
  absl::StatusOr<Worker> Take();
  absl::StatusOr<Worker> Start();
  // False: it ended because it could not confine itself.
  bool GiveBack(Worker worker, bool trusted);
  static int End(const Worker& worker);  // what waitpid says

  const std::string program_;
  const std::chrono::milliseconds patience_;
  std::atomic<int> started_count_ = 0;
  runtime::Counter started_{"sixpoint_decode_workers_started_total", "Decode workers that were started, anew too."};
  runtime::ComputePool at_once_;
  std::mutex mutex_;
  std::vector<Worker> idle_;
};

}  // namespace sixpoint::ingest
