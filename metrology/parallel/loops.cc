#include "metrology/parallel/loops.h"

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>

namespace sixpoint::metrology {

void ForEach(std::size_t count, int thread_count, const std::function<void(std::size_t)>& body) {
  if (thread_count <= 1 || count <= 1) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  // The library orders what comes before the loop, in it and after it; said once more, for a thread sanitizer sees only us.
  std::atomic<bool> begun = false, done = false;
  begun.store(true, std::memory_order_release);
  tbb::task_arena arena(std::min(thread_count, tbb::info::default_concurrency()));
  arena.execute([&] {
    using Range = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(Range(0, count, 1), [&](const Range& range) {
      begun.load(std::memory_order_acquire);
      for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
      done.exchange(true, std::memory_order_release);
    });
  });
  done.load(std::memory_order_acquire);
}

void ForEachChunk(std::size_t count, std::size_t chunk_size, int thread_count,
                  const std::function<void(std::size_t, std::size_t, std::size_t)>& body) {
  ForEach(ChunkCount(count, chunk_size), thread_count,
          [&](std::size_t chunk) { body(chunk, chunk * chunk_size, std::min(count, (chunk + 1) * chunk_size)); });
}

std::size_t PartCount(int thread_count) { return static_cast<std::size_t>(std::max(1, thread_count)); }

void InParts(std::size_t count, int thread_count,
             const std::function<void(std::size_t, std::size_t, std::size_t)>& body) {
  const std::size_t parts = PartCount(thread_count);
  ForEach(parts, thread_count, [&](std::size_t part) { body(count * part / parts, count * (part + 1) / parts, part); });
}

}  // namespace sixpoint::metrology
