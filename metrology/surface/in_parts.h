// The same work on runs of a list, each on a thread of its own.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace sixpoint::metrology {

// Runs body(begin, end, part) over [0, count) in `parts` runs of about equal length.
template <typename Body>
void InParts(std::size_t count, std::size_t parts, const Body& body) {
  std::vector<std::thread> threads;
  for (std::size_t part = 1; part < parts; ++part) {
    threads.emplace_back([&, part] { body(count * part / parts, count * (part + 1) / parts, part); });
  }
  body(0, count / parts, 0);
  for (std::thread& thread : threads) thread.join();
}

// Runs body(begin, end) over [0, count) in runs of a fixed length, whichever thread is free taking the next: for work that
// is not spread evenly, where each of the list has its own result.
template <typename Body>
void InTurns(std::size_t count, std::size_t length, std::size_t thread_count, const Body& body) {
  std::atomic<std::size_t> next = 0;
  InParts(thread_count, thread_count, [&](std::size_t, std::size_t, std::size_t) {
    for (std::size_t begin; (begin = length * next++) < count;) body(begin, std::min(count, begin + length));
  });
}

}  // namespace sixpoint::metrology
