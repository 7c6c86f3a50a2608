#include "services/clients/surface_cache.h"

#include <algorithm>
#include <condition_variable>
#include <list>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

#include "services/runtime/memory_guard.h"

namespace sixpoint::clients {
namespace {

using metrology::Surface;
using SurfacePointer = std::shared_ptr<const Surface>;

constexpr std::chrono::minutes kLongestWait{10};  // for another call's preparation, where the caller set no deadline
constexpr std::chrono::milliseconds kBetweenQuestions{20};

// Memory may end while a surface is made: those who wait for it must hear of it.
SurfaceCache::SurfaceOr Prepared(const std::function<SurfaceCache::SurfaceOr()>& prepare) {
  return runtime::WithinMemory("surface: no memory left to prepare it", prepare);
}

}  // namespace

struct SurfaceCache::State : std::enable_shared_from_this<State> {
  struct Entry {
    std::string sha256;
    SurfacePointer surface;
    std::size_t bytes = 0;
    int user_count = 0;
  };

  State(std::size_t limit, std::function<std::size_t(const Surface&)> bytes)
      : limit_bytes(limit), bytes_of(std::move(bytes)) {}

  const std::size_t limit_bytes;
  const std::function<std::size_t(const Surface&)> bytes_of;
  mutable std::mutex mutex;
  std::condition_variable prepared;
  std::list<Entry> entries;  // newest use first
  std::set<std::string> preparing;

  std::list<Entry>::iterator Find(const std::string& sha256) {
    return std::find_if(entries.begin(), entries.end(), [&](const Entry& entry) { return entry.sha256 == sha256; });
  }

  std::size_t Bytes() const {
    std::size_t bytes = 0;
    for (const Entry& entry : entries) bytes += entry.bytes;
    return bytes;
  }

  // What goes, to be destroyed once the lock is.
  std::vector<SurfacePointer> Shrink() {
    for (Entry& entry : entries) entry.bytes = bytes_of(*entry.surface);
    std::vector<SurfacePointer> gone;
    std::size_t bytes = Bytes();
    for (auto entry = entries.end(); bytes > limit_bytes && entry != entries.begin();) {
      --entry;
      if (entry->user_count > 0) continue;
      bytes -= entry->bytes;
      gone.push_back(std::move(entry->surface));
      entry = entries.erase(entry);
    }
    return gone;
  }

  // Counts one user more until what it gives is gone.
  SurfacePointer Lend(std::list<Entry>::iterator entry) {
    ++entry->user_count;
    entries.splice(entries.begin(), entries, entry);
    return {entry->surface.get(),
            [state = shared_from_this(), sha256 = entry->sha256](const Surface*) { state->Return(sha256); }};
  }

  void Return(const std::string& sha256) {
    std::vector<SurfacePointer> gone;
    const std::lock_guard<std::mutex> lock(mutex);
    --Find(sha256)->user_count;  // an entry in use is there
    gone = Shrink();
  }
};

SurfaceCache::SurfaceCache(std::size_t limit_bytes, std::function<std::size_t(const Surface&)> bytes_of)
    : state_(std::make_shared<State>(limit_bytes, bytes_of ? std::move(bytes_of) : &Surface::memory_bytes)) {}

SurfaceCache::SurfaceOr SurfaceCache::Get(const std::string& sha256, std::chrono::steady_clock::time_point deadline,
                                          const std::function<bool()>& keep_going,
                                          const std::function<SurfaceOr()>& prepare) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point until = std::min(deadline, Clock::now() + kLongestWait);
  {
    std::unique_lock<std::mutex> lock(state_->mutex);
    while (true) {
      if (const auto entry = state_->Find(sha256); entry != state_->entries.end()) return state_->Lend(entry);
      if (state_->preparing.insert(sha256).second) break;
      state_->prepared.wait_until(lock, std::min(until, Clock::now() + kBetweenQuestions));
      if (Clock::now() >= until) return absl::DeadlineExceededError("surface: still being prepared by another call");
      if (keep_going && !keep_going()) return absl::CancelledError("surface: stopped by its caller");
    }
  }
  SurfaceOr surface = Prepared(prepare);
  std::vector<SurfacePointer> gone;
  const std::lock_guard<std::mutex> lock(state_->mutex);
  state_->preparing.erase(sha256);
  state_->prepared.notify_all();
  if (!surface.ok()) return surface.status();
  state_->entries.push_front({sha256, *std::move(surface), 0, 0});
  SurfacePointer lent = state_->Lend(state_->entries.begin());
  gone = state_->Shrink();
  return lent;
}

SurfaceCache::Use SurfaceCache::use() const {
  const std::lock_guard<std::mutex> lock(state_->mutex);
  return {state_->entries.size(), state_->Bytes()};
}

}  // namespace sixpoint::clients
