// Points by cells of space: which of them are near a place. Memory grows with the points alone, wherever they lie: they come from outside.
//
// Mm. Thread-safe to read. A visit goes from cell to cell by x, y, z, and within each in the points' own order.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

class PointCells {
 public:
  // Points that are not finite are in no cell. Keeps no reference to the points.
  PointCells(const Points& points_mm, double cell_mm) : cell_mm_(cell_mm) {
    std::vector<Entry> entries;
    entries.reserve(points_mm.size());
    for (std::size_t i = 0; i < points_mm.size(); ++i)
      if (points_mm[i].allFinite()) entries.push_back({CellOf(points_mm[i]), static_cast<std::uint32_t>(i)});
    std::sort(entries.begin(), entries.end(),
              [](const Entry& a, const Entry& b) { return a.cell != b.cell ? a.cell < b.cell : a.point < b.point; });
    order_.reserve(entries.size());
    for (const Entry& entry : entries) {
      if (cells_.empty() || cells_.back() != entry.cell) {
        cells_.push_back(entry.cell);
        first_.push_back(order_.size());
      }
      order_.push_back(entry.point);
    }
    first_.push_back(order_.size());
    std::size_t slots = 1;
    while (slots < 2 * cells_.size()) slots *= 2;
    slots_.assign(slots, kEmpty);
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      std::size_t slot = SlotOf(cells_[c]);
      while (slots_[slot] != kEmpty) slot = (slot + 1) & (slots_.size() - 1);
      slots_[slot] = static_cast<std::uint32_t>(c);
    }
  }

  // take(index) of every point of the cells that a box meets: all within it, and some about it.
  template <typename Take>
  void In(const Eigen::AlignedBox3d& box_mm, const Take& take) const {
    if (cells_.empty() || box_mm.isEmpty() || !box_mm.min().allFinite() || !box_mm.max().allFinite()) return;
    const Cell low = CellOf(box_mm.min()), high = CellOf(box_mm.max());
    double asked = 1;
    for (std::size_t d = 0; d < 3; ++d) asked *= static_cast<double>(high[d] - low[d]) + 1;
    if (asked > static_cast<double>(cells_.size())) {  // fewer cells hold points than the box has
      for (std::size_t c = 0; c < cells_.size(); ++c) {
        bool within = true;
        for (std::size_t d = 0; d < 3; ++d) within = within && cells_[c][d] >= low[d] && cells_[c][d] <= high[d];
        if (within) TakeCell(c, take);
      }
      return;
    }
    for (std::int64_t x = low[0]; x <= high[0]; ++x)
      for (std::int64_t y = low[1]; y <= high[1]; ++y)
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
          const Cell cell = {x, y, z};
          std::size_t slot = SlotOf(cell);
          while (slots_[slot] != kEmpty && cells_[slots_[slot]] != cell) slot = (slot + 1) & (slots_.size() - 1);
          if (slots_[slot] != kEmpty) TakeCell(slots_[slot], take);
        }
  }
  template <typename Take>
  void Near(const Eigen::Vector3d& centre_mm, double reach_mm, const Take& take) const {
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(reach_mm);
    In(Eigen::AlignedBox3d(centre_mm - reach, centre_mm + reach), take);
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  struct Entry {
    Cell cell;
    std::uint32_t point;
  };
  static constexpr std::uint32_t kEmpty = UINT32_MAX;

  // Beyond the last cell everything is in it: no integer holds 1e300 cells.
  Cell CellOf(const Eigen::Vector3d& place_mm) const {
    constexpr double kLast = 1e15;
    Cell cell;
    for (int k = 0; k < 3; ++k)
      cell[static_cast<std::size_t>(k)] =
          static_cast<std::int64_t>(std::clamp(std::floor(place_mm[k] / cell_mm_), -kLast, kLast));
    return cell;
  }
  std::size_t SlotOf(const Cell& cell) const {
    std::uint64_t mixed = 0;
    for (const std::int64_t part : cell) {
      mixed = (mixed ^ static_cast<std::uint64_t>(part)) * 0x9e3779b97f4a7c15U;
      mixed ^= mixed >> 32U;
    }
    return static_cast<std::size_t>(mixed) & (slots_.size() - 1);
  }
  template <typename Take>
  void TakeCell(std::size_t cell, const Take& take) const {
    for (std::size_t i = first_[cell]; i < first_[cell + 1]; ++i) take(static_cast<std::size_t>(order_[i]));
  }

  double cell_mm_;
  std::vector<Cell> cells_;         // those that hold points, by x, y, z
  std::vector<std::size_t> first_;  // of each cell, in order_; and the end
  std::vector<std::uint32_t> order_;
  std::vector<std::uint32_t> slots_;  // a power of two: cells by their hash, each in the next free slot
};

}  // namespace sixpoint::metrology
