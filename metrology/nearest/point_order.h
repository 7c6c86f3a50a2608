// The order in which very many points are looked up: those of one cell together, and points of no cell beside their
// neighbours. It depends on nothing but the points and the cells.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "metrology/nearest/near_cells.h"

namespace sixpoint::metrology {

// Puts the points with these indices, the same whenever they are asked for; by any thread.
using PointsAt = std::function<void(const std::uint32_t* indices, std::size_t count, Eigen::Vector3d* points_mm)>;
inline constexpr std::size_t kFetchedAtOnce = 1024;  // points that are asked for: the processor waits for many at once

struct PointOrder {
  std::vector<std::uint32_t> order;  // of the points: by cell, those without a cell last
  struct Run {
    std::uint32_t cell, first;  // in `order`, up to where the next begins
  };
  std::vector<Run> runs;  // of each cell that holds points; then one of no cell, where those without begin
  std::size_t in_cells_count = 0;
};

// Fewer than 2^32 points. cells: may be null. far_matter: points of no cell are put beside their neighbours too.
PointOrder OrderOf(const NearCells* cells, const PointsAt& points_at, std::uint32_t count, bool far_matter,
                   int thread_count);

// The cube of space that a point lies in; points far outside share one, those nowhere another.
std::uint64_t PlaceOf(const Eigen::Vector3d& point_mm);
// Neither nowhere nor beyond what squares can hold.
bool IsSomewhere(const Eigen::Vector3d& point_mm);

}  // namespace sixpoint::metrology
