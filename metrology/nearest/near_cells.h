// Where very many points lie near a surface: a grid of cells, each with every triangle that can be the nearest of any point
// in it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "metrology/nearest/candidate_lists.h"
#include "metrology/nearest/triangle_tree.h"

namespace sixpoint::metrology {

// Read by any number of threads; the tree lives longer.
class NearCells {
 public:
  // Every point within covered_mm of the surface lies in a cell. The same on any number of threads.
  NearCells(const TriangleTree& tree, double covered_mm, int thread_count);

  double covered_mm() const { return covered_mm_; }
  float cell_width_mm() const { return static_cast<float>(cell_mm_); }
  std::size_t cell_count() const { return lists_->size(); }
  std::size_t memory_bytes() const;

  static constexpr std::uint32_t kNoCell = 0xffffffff;
  static constexpr std::size_t kTogether = 32;
  // The cells that hold up to kTogether points, kNoCell where there is none.
  void CellsAt(const Eigen::Vector3d* points_mm, std::size_t count, std::uint32_t* cells) const;

  // Among them is the nearest of each point of the cell.
  Candidates CandidatesOf(std::uint32_t cell) const;
  const TriangleShape& shape(std::uint32_t item) const { return shapes_[item]; }

 private:
  struct Listed;  // cells with their candidates
  CandidateLists NoLists() const;

  void FindShapes();  // and from them how wide cells are, and from where on they are counted
  std::vector<std::uint64_t> CellsNearSurface(int thread_count) const;
  void ListEach(const std::vector<std::uint64_t>& keys, int thread_count);
  Listed List(const std::uint64_t* keys, std::size_t count) const;
  void MakeTable(const std::vector<std::uint64_t>& keys);

  Eigen::Vector3d CentreOf(std::uint64_t key) const;
  double radius_mm() const;  // of the ball about a cell
  // Adds the cells from first to last whose centre is in the band about the triangle: no farther than covered and half a
  // cell's diagonal.
  void Touch(const IndexedTriangle& item, const Eigen::Array3i& first, const Eigen::Array3i& last,
             std::vector<std::uint64_t>* touched) const;
  std::uint32_t Find(std::uint64_t key) const;
  // Where a block is looked for first. Of the product only the uppermost bits depend on all of the block's.
  std::size_t SlotOf(std::uint64_t block) const {
    return static_cast<std::size_t>(block * 0x9e3779b97f4a7c15ULL >> slot_shift_);
  }

  const TriangleTree& tree_;
  double covered_mm_;
  double cell_mm_ = 0, per_cell_ = 0;
  Eigen::Vector3d low_mm_;
  std::vector<TriangleShape> shapes_;  // of the tree's items
  // Blocks of 4 x 4 x 4 cells in a hash table with open addressing, small enough for a processor's nearer caches. Cells are numbered block
  // by block, in each by their place.
  struct alignas(32) Block {
    std::uint64_t key = 0;    // and 1; 0: free
    std::uint64_t cells = 0;  // that it has, by bit
    std::uint32_t first_cell = 0;
  };
  std::vector<Block> blocks_;
  int slot_shift_ = 0;
  std::optional<CandidateLists> lists_;  // by cell; once it is known how wide cells are
  Points centres_mm_;                    // of the cells
};

}  // namespace sixpoint::metrology
