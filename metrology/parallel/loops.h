// The one loop on several threads. Threads only decide when a piece of work is done, never what comes out: a body writes what
// is its own, and what is summed is summed over fixed chunks in their order. The same bits on any number of threads.
//
// A body may be called by several threads at once. What it throws ends the loop and comes out of it. Loops may stand inside
// loops. thread_count below 1 counts as 1; the caller's thread is one of them.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace sixpoint::metrology {

// body(i) for each i below count.
void ForEach(std::size_t count, int thread_count, const std::function<void(std::size_t i)>& body);

inline std::size_t ChunkCount(std::size_t count, std::size_t chunk_size) {
  return (count + chunk_size - 1) / chunk_size;
}
// body(chunk, begin, end) over [0, count) in chunks of a fixed size: what each computes goes to its own slot.
void ForEachChunk(std::size_t count, std::size_t chunk_size, int thread_count,
                  const std::function<void(std::size_t chunk, std::size_t begin, std::size_t end)>& body);

// What body(begin, end) makes of each chunk, in their order: the caller adds them up.
template <typename Result, typename Body>
std::vector<Result> OfEachChunk(std::size_t count, std::size_t chunk_size, int thread_count, const Body& body) {
  std::vector<Result> results(ChunkCount(count, chunk_size));
  ForEachChunk(count, chunk_size, thread_count,
               [&](std::size_t chunk, std::size_t begin, std::size_t end) { results[chunk] = body(begin, end); });
  return results;
}

// body(begin, end, part) over [0, count) in as many parts of about equal length as there are threads, for work that wants
// its own space on each. The parts depend on the number of threads, so what comes out must not depend on the parts.
std::size_t PartCount(int thread_count);
void InParts(std::size_t count, int thread_count,
             const std::function<void(std::size_t begin, std::size_t end, std::size_t part)>& body);

}  // namespace sixpoint::metrology
