#include "metrology/parallel/loops.h"

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

#if defined(SIXPOINT_SANITIZES_THREADS)
#include <sanitizer/tsan_interface.h>
#endif

namespace sixpoint::metrology {
namespace {

// The library orders what comes before a loop, in it and after it. A thread sanitizer does not see how, for the library is not
// instrumented (and so neither is this file, in which its headers are): it is told.
class Order {
 public:
#if defined(SIXPOINT_SANITIZES_THREADS)
  void Leave() { __tsan_release(this); }
  void Enter() { __tsan_acquire(this); }
#else
  void Leave() {}
  void Enter() {}
#endif
};

}  // namespace

void ForEach(std::size_t count, int thread_count, const std::function<void(std::size_t)>& body) {
  if (thread_count <= 1 || count <= 1) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  Order before, after;
  before.Leave();
  tbb::task_arena arena(std::min(thread_count, tbb::info::default_concurrency()));
  arena.execute([&] {
    using Range = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(Range(0, count, 1), [&](const Range& range) {
      before.Enter();
      for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
      after.Leave();
    });
  });
  after.Enter();
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
