// Nearest triangles of all points that lie in one cell (near_cells.h) at a time: each triangle is measured against the
// points side by side. The same answers as TriangleTree::Find, to the bit, on every processor: the wide loops measure in
// single precision, and only rule out what is farther than the best by more than that rounds.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "metrology/surface/near_cells.h"
#include "metrology/surface/triangle_tree.h"

namespace sixpoint::metrology {

// Which cell each point lies in, and the points of a cell together.
struct CellOrder {
  std::vector<std::uint32_t> order;  // of the points: by cell, those without a cell last
  std::vector<std::uint32_t> first;  // in `order`, by cell; cell_count() + 1, then order.size()
};

// origin_mm: of the tree's coordinates. Fewer than 2^32 points. The same on any number of threads.
CellOrder PutInCells(const NearCells& cells, const Eigen::Vector3d& origin_mm, const Eigen::Vector3d* points_mm,
                     std::size_t count, int thread_count);

// One thread's working space.
class NearBatch {
 public:
  struct Lanes;  // points side by side
  NearBatch(const TriangleTree& tree, const NearCells& cells);
  ~NearBatch();
  static constexpr std::size_t kMostPoints = 64;
  // queries: up to kMostPoints, all in the cell.
  void Find(std::uint32_t cell, const Eigen::Vector3d* queries, std::size_t count, double limit_squared,
            TriangleTree::Nearest* nearest);

 private:
  const TriangleTree& tree_;
  const NearCells& cells_;
  std::unique_ptr<Lanes> lanes_;
  std::vector<float, Eigen::aligned_allocator<float>> squared_;  // by candidate and lane
};

}  // namespace sixpoint::metrology
