#include "metrology/surface/neighbours.h"

#include <cmath>
#include <limits>

namespace sixpoint::metrology {

using Eigen::Isometry3d;
using Eigen::Vector3d;

std::vector<double> DistancesAt(const Isometry3d& zero_from_part, const Surface& surface, const Points& zero_mm,
                                double limit_mm, int thread_count) {
  const Vector3d margin_mm = Vector3d::Constant(limit_mm);
  const Eigen::AlignedBox3d reach(surface.minimum_mm() - margin_mm, surface.maximum_mm() + margin_mm);
  const Isometry3d part_from_zero = zero_from_part.inverse(Eigen::Isometry);
  std::vector<std::size_t> indices;
  Points part_mm;
  for (std::size_t i = 0; i < zero_mm.size(); ++i) {
    const Vector3d p = part_from_zero * zero_mm[i];
    if (!reach.contains(p)) continue;
    indices.push_back(i);
    part_mm.push_back(p);
  }
  std::vector<double> signed_mm, distances_mm(zero_mm.size(), std::numeric_limits<double>::infinity());
  surface.SignedDistances(part_mm, limit_mm, thread_count, &signed_mm);
  for (std::size_t k = 0; k < indices.size(); ++k)
    if (!std::isnan(signed_mm[k])) distances_mm[indices[k]] = std::abs(signed_mm[k]);
  return distances_mm;
}

std::vector<bool> AreOwn(const std::vector<Isometry3d>& neighbours, const Surface& surface, const Points& zero_mm,
                         const std::vector<double>& own_mm, double limit_mm, int thread_count) {
  std::vector<bool> are_own(zero_mm.size(), false);
  std::vector<std::size_t> near;
  Points near_zero_mm;
  for (std::size_t i = 0; i < zero_mm.size(); ++i) {
    if (!std::isfinite(own_mm[i])) continue;
    are_own[i] = true;
    near.push_back(i);
    near_zero_mm.push_back(zero_mm[i]);
  }
  for (const Isometry3d& neighbour : neighbours) {
    const std::vector<double> its_mm = DistancesAt(neighbour, surface, near_zero_mm, limit_mm, thread_count);
    for (std::size_t k = 0; k < near.size(); ++k)
      if (its_mm[k] < own_mm[near[k]]) are_own[near[k]] = false;
  }
  return are_own;
}

}  // namespace sixpoint::metrology
