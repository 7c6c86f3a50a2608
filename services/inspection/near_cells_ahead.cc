#include "services/inspection/near_cells_ahead.h"

#include <chrono>
#include <utility>

namespace sixpoint::inspection {

void NearCellsAhead::Begin(std::shared_ptr<const metrology::Surface> surface) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (last_.lock() == surface) return;
  if (job_.valid() && job_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  last_ = surface;
  // What fails (no memory) leaves the surface as it was. The other threads are for the calls that come meanwhile.
  job_ = std::async(std::launch::async, [surface = std::move(surface)] { surface->PrepareNear(1); });
}

}  // namespace sixpoint::inspection
