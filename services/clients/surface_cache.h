// Prepared surfaces shared between calls, within a limit of memory. The least recently used go first; one that is in use
// stays, for letting it go would free nothing. Surfaces grow while they are used (near cells are made when first wanted), so
// their memory is asked for again at the end of every use.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "metrology/surface/surface.h"

namespace sixpoint::clients {

// Thread-safe. What it gave may outlive it.
class SurfaceCache {
 public:
  using SurfaceOr = absl::StatusOr<std::shared_ptr<const metrology::Surface>>;

  // bytes_of: what a surface takes now; called with the cache locked.
  explicit SurfaceCache(std::size_t limit_bytes,
                        std::function<std::size_t(const metrology::Surface&)> bytes_of = nullptr);

  // The surface of that digest; where there is none, the caller's `prepare` makes it, once for all that ask meanwhile. They
  // wait, at most until their deadline (DEADLINE_EXCEEDED) or until keep_going (may be empty) says no (CANCELLED); where it
  // fails, the next of them tries. RESOURCE_EXHAUSTED: there was no memory to make it.
  SurfaceOr Get(const std::string& sha256, std::chrono::steady_clock::time_point deadline,
                const std::function<bool()>& keep_going, const std::function<SurfaceOr()>& prepare);

  struct Use {
    std::size_t surface_count = 0;
    std::size_t bytes = 0;
  };
  Use use() const;

 private:
  struct State;
  const std::shared_ptr<State> state_;
};

}  // namespace sixpoint::clients
