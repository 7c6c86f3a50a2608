#include "metrology/nearest/point_order.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// How many of a part's points each cell holds; those of no cell share one.
class CellCounts {
 public:
  void Start(std::uint32_t cell_count) {
    counts_.assign(cell_count, 0);
    holding_.assign(cell_count / 64 + 1, 0);
  }
  void Count(std::uint32_t cell) {
    ++counts_[cell];
    holding_[cell / 64] |= std::uint64_t{1} << cell % 64;
  }
  std::uint32_t& operator[](std::uint32_t cell) { return counts_[cell]; }
  // take(cell) of each that holds any of the points of any part, in their order: where points are few, most cells hold none.
  template <typename Take>
  static void ForEachHolding(const std::vector<CellCounts>& parts, const Take& take) {
    for (std::size_t word = 0; word < parts.front().holding_.size(); ++word) {
      std::uint64_t holding = 0;
      for (const CellCounts& part : parts) holding |= part.holding_[word];
      for (; holding != 0; holding &= holding - 1)
        take(static_cast<std::uint32_t>(64 * word) + static_cast<std::uint32_t>(__builtin_ctzll(holding)));
    }
  }

 private:
  std::vector<std::uint32_t> counts_;
  std::vector<std::uint64_t> holding_;  // a bit for each cell
};

// Counting sort: each part counts its points of each cell, and puts them where the parts before it end.
void PutInCells(const NearCells& cells, const PointsAt& points_at, std::uint32_t count, int thread_count,
                PointOrder* order) {
  const auto no_cell = static_cast<std::uint32_t>(cells.cell_count());
  std::vector<std::uint32_t> cell_of(count);
  std::vector<CellCounts> parts(PartCount(thread_count));
  InParts(count, thread_count, [&](std::size_t begin, std::size_t end, std::size_t part) {
    parts[part].Start(no_cell + 1);
    std::array<Vector3d, NearCells::kTogether> points;
    std::array<std::uint32_t, NearCells::kTogether> indices;
    for (std::size_t at = begin; at < end; at += points.size()) {
      const std::size_t together = std::min(points.size(), end - at);
      std::iota(indices.begin(), indices.end(), static_cast<std::uint32_t>(at));
      points_at(indices.data(), together, points.data());
      cells.CellsAt(points.data(), together, &cell_of[at]);
      for (std::size_t i = at; i < at + together; ++i) parts[part].Count(cell_of[i] = std::min(cell_of[i], no_cell));
    }
  });
  std::uint32_t sum = 0;
  CellCounts::ForEachHolding(parts, [&](std::uint32_t cell) {
    order->runs.push_back({cell, sum});
    for (CellCounts& of_part : parts) {
      const std::uint32_t here = of_part[cell];
      of_part[cell] = sum;
      sum += here;
    }
  });
  if (order->runs.empty() || order->runs.back().cell != no_cell) order->runs.push_back({no_cell, sum});
  order->in_cells_count = order->runs.back().first;
  order->order.resize(count);
  InParts(count, thread_count, [&](std::size_t begin, std::size_t end, std::size_t part) {
    for (std::size_t i = begin; i < end; ++i) order->order[parts[part][cell_of[i]]++] = static_cast<std::uint32_t>(i);
  });
}

// Those without a cell, by place, then by index.
void PutFarInPlaces(const PointsAt& points_at, int thread_count, PointOrder* order) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> far(order->order.size() - order->in_cells_count);
  const std::size_t parts = PartCount(thread_count);
  const auto at = [&](std::size_t k) { return far.begin() + static_cast<std::ptrdiff_t>(k); };
  InParts(far.size(), thread_count, [&](std::size_t begin, std::size_t end, std::size_t) {
    std::array<Vector3d, kFetchedAtOnce> points;
    for (std::size_t k = begin; k < end; k += kFetchedAtOnce) {
      const std::size_t some = std::min(kFetchedAtOnce, end - k);
      const std::uint32_t* indices = &order->order[order->in_cells_count + k];
      points_at(indices, some, points.data());
      for (std::size_t i = 0; i < some; ++i) far[k + i] = {PlaceOf(points[i]), indices[i]};
    }
    std::sort(at(begin), at(end));
  });
  for (std::size_t part = 1; part < parts; ++part)
    std::inplace_merge(far.begin(), at(far.size() * part / parts), at(far.size() * (part + 1) / parts));
  for (std::size_t k = 0; k < far.size(); ++k) order->order[order->in_cells_count + k] = far[k].second;
}

}  // namespace

bool IsSomewhere(const Vector3d& point_mm) { return point_mm.cwiseAbs().maxCoeff() <= 1e12 && point_mm.allFinite(); }

std::uint64_t PlaceOf(const Vector3d& point_mm) {
  constexpr double kCubeMm = 0.5;
  constexpr std::uint64_t kAcross = 1 << 20, kOutside = std::uint64_t{1} << 62;
  if (!IsSomewhere(point_mm)) return kOutside + 1;
  std::uint64_t place = 0;
  for (int k = 0; k < 3; ++k) {
    const double at = point_mm[k] / kCubeMm + kAcross / 2;
    if (!(at >= 0 && at < kAcross)) return kOutside;
    place = place * kAcross + static_cast<std::uint64_t>(at);
  }
  return place;
}

PointOrder OrderOf(const NearCells* cells, const PointsAt& points_at, std::uint32_t count, bool far_matter,
                   int thread_count) {
  PointOrder order;
  if (cells != nullptr) {
    PutInCells(*cells, points_at, count, thread_count, &order);
  } else {
    order.order.resize(count);
    std::iota(order.order.begin(), order.order.end(), 0);
  }
  if (far_matter) PutFarInPlaces(points_at, thread_count, &order);
  return order;
}

}  // namespace sixpoint::metrology
