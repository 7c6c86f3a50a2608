// For what comes about in another thread or process: a log's line, a row, an answer.
#pragma once

#include <chrono>
#include <thread>

namespace sixpoint::testing {

// Whether it is so, at once or within this time.
template <typename Condition>
bool Becomes(std::chrono::milliseconds patience, Condition is_so) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!is_so() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return is_so();
}

}  // namespace sixpoint::testing
