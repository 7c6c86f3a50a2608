// Memory that ends in a thread of ours is an answer, and not the process's end: gRPC guards only the threads that it calls handlers on.
#pragma once

#include <absl/status/status.h>

#include <new>
#include <string>

namespace sixpoint::runtime {

// work() gives a StatusOr. RESOURCE_EXHAUSTED: no memory was left for it. what: for whom, and what was to be done.
template <typename Work>
auto WithinMemory(const std::string& what, const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(what + ", want fewer calls at once; try again");
  }
}

}  // namespace sixpoint::runtime
