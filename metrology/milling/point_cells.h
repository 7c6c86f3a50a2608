// Points by cells of space: which of them are near a place. Mm. Thread-safe to read; the order of a visit is the points' own within each cell.
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
  PointCells(const Points& points_mm, double cell_mm) : points_mm_(points_mm), cell_mm_(cell_mm) {
    for (const Eigen::Vector3d& point : points_mm) bounds_mm_.extend(point);
    if (points_mm.empty()) return;
    for (int k = 0; k < 3; ++k) count_[static_cast<std::size_t>(k)] = At(bounds_mm_.max()[k], k) + 1;
    std::vector<std::size_t> cell_of;
    first_.assign(static_cast<std::size_t>(count_[0] * count_[1] * count_[2]) + 1, 0);
    for (const Eigen::Vector3d& point : points_mm) {
      cell_of.push_back(Cell(At(point.x(), 0), At(point.y(), 1), At(point.z(), 2)));
      ++first_[cell_of.back() + 1];
    }
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    order_.resize(points_mm.size());
    for (std::size_t i = 0; i < points_mm.size(); ++i) order_[next[cell_of[i]]++] = static_cast<std::uint32_t>(i);
  }

  // take(index) of every point of the cells that a box meets: all within it, and some about it.
  template <typename Take>
  void In(const Eigen::AlignedBox3d& box_mm, const Take& take) const {
    if (points_mm_.empty() || !bounds_mm_.intersects(box_mm)) return;
    std::array<std::int64_t, 3> low, high;
    for (int k = 0; k < 3; ++k) {
      const auto d = static_cast<std::size_t>(k);
      low[d] = std::clamp<std::int64_t>(At(box_mm.min()[k], k), 0, count_[d] - 1);
      high[d] = std::clamp<std::int64_t>(At(box_mm.max()[k], k), 0, count_[d] - 1);
    }
    for (std::int64_t x = low[0]; x <= high[0]; ++x)
      for (std::int64_t y = low[1]; y <= high[1]; ++y)
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
          const std::size_t cell = Cell(x, y, z);
          for (std::size_t i = first_[cell]; i < first_[cell + 1]; ++i) take(static_cast<std::size_t>(order_[i]));
        }
  }
  template <typename Take>
  void Near(const Eigen::Vector3d& centre_mm, double reach_mm, const Take& take) const {
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(reach_mm);
    In(Eigen::AlignedBox3d(centre_mm - reach, centre_mm + reach), take);
  }

 private:
  std::int64_t At(double value_mm, int k) const {
    return static_cast<std::int64_t>(std::floor((value_mm - bounds_mm_.min()[k]) / cell_mm_));
  }
  std::size_t Cell(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return static_cast<std::size_t>((x * count_[1] + y) * count_[2] + z);
  }

  const Points& points_mm_;
  double cell_mm_;
  Eigen::AlignedBox3d bounds_mm_;
  std::array<std::int64_t, 3> count_ = {1, 1, 1};
  std::vector<std::size_t> first_;
  std::vector<std::uint32_t> order_;
};

}  // namespace sixpoint::metrology
