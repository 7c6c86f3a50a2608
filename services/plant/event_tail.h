// The end of the journal, read once for all who listen to it: every few milliseconds it is asked whether there is more, and what there is
// is handed to each of them. Who is further behind than what is kept here reads the journal itself.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "storage/events.h"

namespace sixpoint::plant {

struct EventTailOptions {
  std::chrono::milliseconds every{10};
  // How long entries are kept here: who may see a part is asked when they are read.
  std::chrono::milliseconds kept_for{1000};
  std::size_t most_kept_bytes = 8 << 20;
  // A journal that could not be read for so long is away.
  std::chrono::milliseconds patience{2000};
};

// One thread, which sleeps while nobody listens. Thread-safe; outlives its listeners.
class EventTail {
 public:
  using Clock = std::chrono::steady_clock;
  // Of a connection of its own: it does not wait behind calls.
  EventTail(std::shared_ptr<const storage::EventReader> journal, const EventTailOptions& options = {});
  ~EventTail();
  EventTail(const EventTail&) = delete;
  EventTail& operator=(const EventTail&) = delete;

  // While one lives the journal is read.
  class Listener {
   public:
    explicit Listener(EventTail* tail);
    ~Listener();
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

   private:
    EventTail* const tail_;
  };

  using Entry = std::shared_ptr<const storage::EventRow>;
  struct After {
    bool is_kept = false;  // false: it lies further back than what is kept here
    std::vector<Entry> entries;
    std::int64_t looked_at_sequence = 0;
  };
  // What came after that number, at most so many; waits for it, but not past `until`. UNAVAILABLE: the journal is away, or the service
  // stops.
  absl::StatusOr<After> Wait(std::int64_t after_sequence, std::size_t most, Clock::time_point until);
  // Nobody waits any more, for ever.
  void Stop();

 private:
  struct Kept {
    Entry entry;
    std::size_t bytes;
    Clock::time_point read_at;
  };
  void Run();
  absl::StatusOr<storage::EventPage> Read(bool begins, std::int64_t after_sequence) const;
  void Take(bool begins, storage::EventPage page);
  void Forget();

  const std::shared_ptr<const storage::EventReader> journal_;
  const EventTailOptions options_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  int listener_count_ = 0;
  bool is_reading_ = false;  // from_ and upto_ hold
  // What is kept is all past from_, as far as upto_.
  std::int64_t from_sequence_ = 0, upto_sequence_ = 0;
  std::deque<Kept> kept_;
  std::size_t kept_bytes_ = 0;
  Clock::time_point answered_;
  std::thread thread_;
};

}  // namespace sixpoint::plant
