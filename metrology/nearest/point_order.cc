#include "metrology/nearest/point_order.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// Counting sort: each part counts its points of each cell, and puts them where the parts before it end.
void PutInCells(const NearCells& cells, const PointsAt& points_at, std::uint32_t count, int thread_count,
                PointOrder* order) {
  const auto cell_count = static_cast<std::uint32_t>(cells.cell_count());
  std::vector<std::uint32_t> cell_of(count);
  std::vector<std::vector<std::uint32_t>> counts(PartCount(thread_count));
  InParts(count, thread_count, [&](std::size_t begin, std::size_t end, std::size_t part) {
    std::vector<std::uint32_t>& here = counts[part];
    here.assign(cell_count + 1, 0);
    std::array<Vector3d, NearCells::kTogether> points;
    std::array<std::uint32_t, NearCells::kTogether> indices;
    for (std::size_t at = begin; at < end; at += points.size()) {
      const std::size_t together = std::min(points.size(), end - at);
      std::iota(indices.begin(), indices.end(), static_cast<std::uint32_t>(at));
      points_at(indices.data(), together, points.data());
      cells.CellsAt(points.data(), together, &cell_of[at]);
      for (std::size_t i = at; i < at + together; ++i) ++here[cell_of[i] = std::min(cell_of[i], cell_count)];
    }
  });
  order->first.resize(cell_count + 2);
  std::uint32_t sum = 0;
  for (std::uint32_t cell = 0; cell <= cell_count; ++cell) {
    order->first[cell] = sum;
    for (std::vector<std::uint32_t>& of_part : counts) {
      const std::uint32_t here = of_part[cell];
      of_part[cell] = sum;
      sum += here;
    }
  }
  order->first[cell_count + 1] = sum;
  order->in_cells_count = order->first[cell_count];
  order->order.resize(count);
  InParts(count, thread_count, [&](std::size_t begin, std::size_t end, std::size_t part) {
    for (std::size_t i = begin; i < end; ++i) order->order[counts[part][cell_of[i]]++] = static_cast<std::uint32_t>(i);
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
