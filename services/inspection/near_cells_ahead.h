// A part's first inspection is over sooner without near cells (Surface::PrepareNear), each one after it sooner with them: they are made between.
#pragma once

#include <future>
#include <memory>
#include <mutex>

#include "metrology/surface/surface.h"

namespace sixpoint::inspection {

// Thread-safe. Its end waits for what it began: some seconds of one thread.
class NearCellsAhead {
 public:
  // Makes the surface ready behind the caller's back, one surface at a time: where another is being made, the next inspection asks again.
  void Begin(std::shared_ptr<const metrology::Surface> surface);

 private:
  std::mutex mutex_;
  std::weak_ptr<const metrology::Surface> last_;
  std::future<void> job_;
};

}  // namespace sixpoint::inspection
