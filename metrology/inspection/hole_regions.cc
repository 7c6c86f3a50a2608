#include "metrology/inspection/hole_regions.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace sixpoint::metrology {
namespace {

constexpr double kLeastCell_mm = 0.5;
constexpr double kMostCells = 1 << 18;  // a megabyte
// Far beyond what rounding moves a point or a border, so that no cell lacks a region that holds one of its points.
constexpr double kMargin_mm = 1e-3;

// The square of the point's distance from the axis; none outside of the region.
std::optional<double> SquareIn(const HoleRegion& region, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3d from = point_mm - region.start_mm;
  const double height = from.dot(region.axis);
  if (height < region.lowest_mm || height > region.highest_mm) return std::nullopt;
  const double square = (from - height * region.axis).squaredNorm();
  if (square >= region.radius_mm * region.radius_mm) return std::nullopt;
  return square;
}

Eigen::AlignedBox3d BoxOf(const HoleRegion& region) {
  // A disc across the axis reaches radius * sin of the angle between the axis and a coordinate's.
  const Eigen::Array3d across = region.radius_mm * (1 - region.axis.array().square()).max(0).sqrt() + kMargin_mm;
  const Eigen::Vector3d low = region.start_mm + region.lowest_mm * region.axis;
  const Eigen::Vector3d high = region.start_mm + region.highest_mm * region.axis;
  return {(low.array().min(high.array()) - across).matrix(), (low.array().max(high.array()) + across).matrix()};
}

}  // namespace

HoleRegions::HoleRegions(std::vector<HoleRegion> regions) : regions_(std::move(regions)) {
  for (const HoleRegion& region : regions_) box_mm_.extend(BoxOf(region));
  if (regions_.empty()) return;
  MakeGrid();
  MakeCells();
}

void HoleRegions::MakeGrid() {
  const Eigen::Array3d sides = box_mm_.sizes().array();
  // So that there are about as many as may be.
  cell_mm_ = std::max(kLeastCell_mm, std::cbrt(sides.prod() / kMostCells));
  const auto counts = [&] { return Eigen::Array3d((sides / cell_mm_).floor() + 1); };
  while (counts().prod() > kMostCells) cell_mm_ *= 1.1;
  counts_ = counts().cast<int>();
}

void HoleRegions::MakeCells() {
  const double half_diagonal_mm = 0.5 * std::sqrt(3.0) * cell_mm_ + kMargin_mm;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;  // cell, region
  for (std::uint32_t k = 0; k < regions_.size(); ++k) {
    HoleRegion wider = regions_[k];  // a cell's middle stands in it wherever the cell has a point in the region
    wider.radius_mm += half_diagonal_mm;
    wider.lowest_mm -= half_diagonal_mm;
    wider.highest_mm += half_diagonal_mm;
    const Eigen::AlignedBox3d box = BoxOf(regions_[k]);
    const auto cell_at = [&](const Eigen::Vector3d& point_mm) {
      return Eigen::Array3i(
          ((point_mm - box_mm_.min()).array() / cell_mm_).floor().cast<int>().max(0).min(counts_ - 1));
    };
    const Eigen::Array3i low = cell_at(box.min()), high = cell_at(box.max());
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x) {
          const Eigen::Vector3d middle = box_mm_.min() + cell_mm_ * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
          if (!SquareIn(wider, middle)) continue;
          pairs.emplace_back(static_cast<std::uint32_t>((z * counts_.y() + y) * counts_.x() + x), k);
        }
  }
  std::sort(pairs.begin(), pairs.end());
  first_.assign(static_cast<std::size_t>(counts_.prod()) + 1, 0);
  for (const auto& [cell, region] : pairs) {
    ++first_[cell + 1];
    listed_.push_back(region);
  }
  for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
}

std::size_t HoleRegions::CellOf(const Eigen::Vector3d& point_mm) const {
  const Eigen::Array3d at = (point_mm - box_mm_.min()).array() / cell_mm_;
  const Eigen::Array3i cell = at.cast<int>().min(counts_ - 1);  // of a point in the box: not negative
  return static_cast<std::size_t>((cell.z() * counts_.y() + cell.y()) * counts_.x() + cell.x());
}

std::size_t HoleRegions::At(const Eigen::Vector3d& point_mm) const {
  std::size_t nearest = regions_.size();
  if (!box_mm_.contains(point_mm)) return nearest;
  const std::size_t cell = CellOf(point_mm);
  double least = 0;
  for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
    const std::uint32_t region = listed_[i];
    const std::optional<double> square = SquareIn(regions_[region], point_mm);
    if (!square || (nearest < regions_.size() && *square >= least)) continue;
    nearest = region;
    least = *square;
  }
  return nearest;
}

}  // namespace sixpoint::metrology
