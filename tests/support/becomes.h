// For what comes about in another thread or process: a log's line, a row, an answer.
#pragma once

#include <chrono>
#include <thread>

namespace sixpoint::testing {

// Whether it is so, at once or within this time; asked no more once it was.
template <typename Condition>
bool Becomes(std::chrono::milliseconds patience, Condition is_so) {
  const auto end = std::chrono::steady_clock::now() + patience;
  for (;; std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
    if (is_so()) return true;
    if (std::chrono::steady_clock::now() >= end) return false;
  }
}

}  // namespace sixpoint::testing
