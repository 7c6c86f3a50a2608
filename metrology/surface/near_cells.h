// Nearest triangles for very many points near a surface: a grid of cells, each with every triangle that can be the nearest
// of any point in it. The same answers as TriangleTree::Find, to the bit, several times as fast.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "metrology/surface/triangle_tree.h"

namespace sixpoint::metrology {

// Read by any number of threads; the tree lives longer.
class NearCells {
 public:
  // What an item looks like in single precision, wherever the cell: one line of the processor's cache.
  struct alignas(64) Shape {
    float bx, by, bz, cx, cy, cz, nx, ny, nz;  // edges, unit normal
    float vx, vy, vz, wx, wy, wz;              // barycentric coordinates of p - corner: its products with these
    float rounding;                            // of a distance, for each millimetre from the corner
  };

  // Every point within covered_mm of the surface lies in a cell. The same on any number of threads.
  NearCells(const TriangleTree& tree, double covered_mm, int thread_count);

  double covered_mm() const { return covered_mm_; }
  std::size_t cell_count() const { return first_.size() - 1; }
  std::size_t memory_bytes() const;
  static constexpr std::uint32_t kNoCell = 0xffffffff;
  static constexpr std::size_t kTogether = 32;
  // The cells that hold up to kTogether points, kNoCell where there is none.
  void CellsAt(const Eigen::Vector3d* points_mm, std::size_t count, std::uint32_t* cells) const;
  const Eigen::Vector3d& centre_mm(std::uint32_t cell) const { return centres_mm_[cell]; }
  float cell_width_mm() const { return static_cast<float>(cell_mm_); }

 private:
  friend class NearBatch;
  static constexpr std::uint32_t kGroup = 4;

  static Shape ShapeOf(const Eigen::Vector3d& ab, const Eigen::Vector3d& ac);
  // Puts candidates in order and adds them as a cell's are kept: nearest first, in groups of four (the last one repeated),
  // and how far the nearest of each group is. Returns the number of groups.
  static std::uint32_t List(std::vector<TriangleTree::Within>* candidates, std::vector<std::uint32_t>* items,
                            std::vector<float>* group_distance);

  Eigen::Vector3d CentreOf(std::uint64_t key) const;
  // Adds the cells from first to last whose centre is in the band about the triangle: no farther than covered and half a
  // cell's diagonal.
  void Touch(const TriangleTree::Item& item, const Eigen::Array3i& first, const Eigen::Array3i& last,
             std::vector<std::uint64_t>* touched) const;
  std::uint32_t Find(std::uint64_t key) const;

  const TriangleTree& tree_;
  double covered_mm_;
  double cell_mm_ = 0, per_cell_ = 0;
  Eigen::Vector3d low_mm_;
  std::vector<Shape, Eigen::aligned_allocator<Shape>> shapes_;  // of the tree's items
  // Hash table, open addressing: key + 1 (0: free) and the cell's index.
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> cells_;
  // By cell: its items, as List puts them about its centre.
  std::vector<std::uint32_t> first_;  // group
  std::vector<std::uint32_t> items_;
  std::vector<float> group_distance_;
  Points centres_mm_;  // of the cells
};

}  // namespace sixpoint::metrology
