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
  // What an item looks like in single precision, wherever the cell.
  struct Shape {
    float bx, by, bz, cx, cy, cz, nx, ny, nz;  // edges, unit normal
    float vx, vy, vz, wx, wy, wz;              // barycentric coordinates of p - corner: its products with these
    float per_bb, per_cc, per_ee, per_area;    // 1 / |edge|^2, 1 / twice the area
    float rounding;                            // of a distance, for each millimetre from the corner
    float size;                                // longer edge
  };

  // Every point within covered_mm of the surface lies in a cell. The same on any number of threads.
  NearCells(const TriangleTree& tree, double covered_mm, int thread_count);

  double covered_mm() const { return covered_mm_; }
  std::size_t cell_count() const { return first_.size() - 1; }
  std::size_t memory_bytes() const;
  static constexpr std::uint32_t kNoCell = 0xffffffff;
  // The cells that hold points, kNoCell where there is none; of all points less the origin.
  void CellsAt(const Eigen::Vector3d* points_mm, const Eigen::Vector3d& origin_mm, std::size_t count,
               std::uint32_t* cells) const;
  const Eigen::Vector3d& centre_mm(std::uint32_t cell) const { return centres_mm_[cell]; }
  float cell_width_mm() const { return static_cast<float>(cell_mm_); }

 private:
  friend class NearCursor;
  friend class NearBatch;
  static constexpr std::uint32_t kGroup = 4;

  static Shape ShapeOf(const Eigen::Vector3d& ab, const Eigen::Vector3d& ac);

  Eigen::Vector3d CentreOf(const Eigen::Array3i& cell) const;
  std::uint32_t Find(std::uint64_t key) const;

  const TriangleTree& tree_;
  double covered_mm_;
  double cell_mm_ = 0, per_cell_ = 0;
  Eigen::Vector3d low_mm_;
  std::vector<Shape> shapes_;  // of the tree's items
  // Hash table, open addressing: key + 1 (0: free) and the cell's index.
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> cells_;
  // By cell: its items, nearest to its centre first, in groups of four (the last one repeated), and how far the nearest of
  // each group is from the centre.
  std::vector<std::uint32_t> first_;  // group
  std::vector<std::uint32_t> items_;
  std::vector<float> group_distance_;
  Points centres_mm_;  // of the cells
};

// One thread's way through its points; quick where each is near the one before.
class NearCursor {
 public:
  // `cells` null: the tree alone.
  NearCursor(const TriangleTree& tree, const NearCells* cells)
      : tree_(tree), cells_(cells), visits_(cells == nullptr ? 0 : kVisits) {}
  TriangleTree::Nearest Find(const Eigen::Vector3d& query, double limit_squared, std::uint32_t hint);

 private:
  // Four triangles in single precision about the cell's centre.
  struct Group {
    Eigen::Array4f ax, ay, az, bx, by, bz, cx, cy, cz, nx, ny, nz;  // corner, edges, unit normal
    Eigen::Array4f per_bb, per_cc, per_ee, per_area;                // 1 / |edge|^2, 1 / twice the area
    float tolerance = 0;                                            // of a distance
  };
  // A cell entered lately, its groups filled as far as they were needed.
  struct Visit {
    std::uint64_t key = ~std::uint64_t{0};
    std::uint32_t cell = 0xffffffff;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    std::vector<Group, Eigen::aligned_allocator<Group>> groups;
  };
  static constexpr std::size_t kVisits = 32;  // a power of two
  Visit& Enter(std::uint64_t key, const Eigen::Array3i& cell);
  void Fill(std::uint32_t group, Visit* visit) const;
  void Measure(const Group& group, const Eigen::Vector3f& query, float* distances_squared) const;

  const TriangleTree& tree_;
  const NearCells* cells_;
  std::vector<Visit> visits_;
  std::vector<float, Eigen::aligned_allocator<float>> distances_squared_;
};

}  // namespace sixpoint::metrology
