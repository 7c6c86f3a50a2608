// Nearest triangles of all points that lie in one cell (near_cells.h) at a time: each triangle is measured against the
// points side by side. The same answers as TriangleTree::Find, to the bit, on every processor: the wide loops measure in
// single precision, and only rule out what is farther than the best by more than that rounds.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
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

// Puts points [begin, begin + count), in the tree's coordinates; asked by any thread.
using QueriesAt = std::function<void(std::uint32_t begin, std::size_t count, Eigen::Vector3d* queries)>;

// Fewer than 2^32 points. The same on any number of threads.
CellOrder PutInCells(const NearCells& cells, const QueriesAt& queries_at, std::size_t count, int thread_count);

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
  // queries: up to kMostPoints, anywhere; quick where they are near to each other. The hint as in TriangleTree::Find.
  void FindAround(const Eigen::Vector3d* queries, std::size_t count, double limit_squared, std::uint32_t hint,
                  TriangleTree::Nearest* nearest);

 private:
  // Triangles among which the nearest of each query is, as NearCells lists them.
  struct Candidates {
    Eigen::Vector3d centre;  // about which points are measured
    float width_mm;          // no query is farther from it
    const std::uint32_t* items;
    const float* group_distance;
    std::uint32_t group_count;
  };
  // The nearest of the candidates within the limit, of each query.
  void Measure(const Candidates& candidates, const Eigen::Vector3d* queries, std::size_t count, double limit_squared,
               TriangleTree::Nearest* nearest);

  const TriangleTree& tree_;
  const NearCells& cells_;
  std::unique_ptr<Lanes> lanes_;
  std::vector<float, Eigen::aligned_allocator<float>> squared_;  // by candidate and lane
  std::vector<TriangleTree::Within> within_;
  std::vector<std::uint32_t> items_;
  std::vector<float> group_distance_;
};

}  // namespace sixpoint::metrology
