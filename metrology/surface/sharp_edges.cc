#include "metrology/surface/sharp_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sixpoint::metrology {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr std::size_t kLeafSize = 4;

}  // namespace

SharpEdges::SharpEdges(std::vector<Edge> edges) : edges_(std::move(edges)) {
  if (edges_.empty()) return;
  std::size_t count = 1;
  for (std::size_t leaf = edges_.size(); leaf > kLeafSize; leaf = (leaf + 1) / 2) count = 2 * count + 1;
  nodes_.resize(count);
  Bound(0, {0, edges_.size()});
}

void SharpEdges::Bound(std::size_t node, Range range) {
  const auto [begin, end] = range;
  AlignedBox3d box, middles;
  for (std::size_t k = begin; k < end; ++k) {
    box.extend(edges_[k].from_mm).extend(edges_[k].from_mm + edges_[k].along_mm);
    middles.extend(edges_[k].from_mm + 0.5 * edges_[k].along_mm);
  }
  nodes_[node] = box;
  if (end - begin <= kLeafSize) return;
  Eigen::Index axis;
  middles.sizes().maxCoeff(&axis);
  const std::size_t half = begin + (end - begin + 1) / 2;
  const auto at = [&](std::size_t k) { return edges_.begin() + static_cast<std::ptrdiff_t>(k); };
  std::nth_element(at(begin), at(half), at(end), [axis](const Edge& a, const Edge& b) {
    return 2 * a.from_mm[axis] + a.along_mm[axis] < 2 * b.from_mm[axis] + b.along_mm[axis];
  });
  Bound(2 * node + 1, {begin, half});
  Bound(2 * node + 2, {half, end});
}

double SharpEdges::Distance(const Vector3d& point_mm, double reach_mm) const {
  constexpr double kOutOfReach = std::numeric_limits<double>::infinity();
  if (edges_.empty()) return kOutOfReach;
  const double reach_squared = reach_mm * reach_mm;
  double squared = std::nextafter(reach_squared, kOutOfReach);
  Search(0, {0, edges_.size()}, point_mm, &squared);
  return squared <= reach_squared ? std::sqrt(squared) : kOutOfReach;
}

void SharpEdges::Search(std::size_t node, Range range, const Vector3d& point_mm, double* squared) const {
  if (!(nodes_[node].squaredExteriorDistance(point_mm) < *squared)) return;
  const auto [begin, end] = range;
  if (end - begin <= kLeafSize) {
    for (std::size_t k = begin; k < end; ++k) {
      const Vector3d from = point_mm - edges_[k].from_mm;
      const double at = std::clamp(edges_[k].along_mm.dot(from) / edges_[k].along_mm.squaredNorm(), 0.0, 1.0);
      *squared = std::min(*squared, (from - at * edges_[k].along_mm).squaredNorm());
    }
    return;
  }
  const std::size_t half = begin + (end - begin + 1) / 2;
  Search(2 * node + 1, {begin, half}, point_mm, squared);
  Search(2 * node + 2, {half, end}, point_mm, squared);
}

}  // namespace sixpoint::metrology
