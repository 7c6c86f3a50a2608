// What a thread has computed for, however busy the computer is with others.
#pragma once

#include <time.h>

#include <chrono>

namespace sixpoint::testing {

// Of the calling thread, since it began.
inline std::chrono::nanoseconds ProcessorTime() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return std::chrono::seconds(used.tv_sec) + std::chrono::nanoseconds(used.tv_nsec);
}

}  // namespace sixpoint::testing
