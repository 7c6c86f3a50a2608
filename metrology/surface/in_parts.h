// The same work on runs of a list, each on a thread of its own.
#pragma once

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

}  // namespace sixpoint::metrology
