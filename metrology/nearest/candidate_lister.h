// The candidates of cells: of several that lie near each other together, their centres measured side by side (near_lanes.h).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "metrology/nearest/candidate_lists.h"
#include "metrology/nearest/triangle_tree.h"

namespace sixpoint::metrology {

// Frame: the tree's. One thread's working space. What it lists depends on the cells of a call and, by what single precision rounds, on the
// lanes' width.
class CandidateLister {
 public:
  // shapes: of the tree's items.
  CandidateLister(const TriangleTree& tree, const std::vector<TriangleShape>& shapes) : tree_(tree), shapes_(shapes) {}

  static constexpr std::size_t kMostCells = NearLanes::kMultiple;
  static_assert(kMostCells <= 32);
  // Adds the lists of up to kMostCells cells, each within radius_mm of its centre: every triangle that can be the nearest of any point in
  // it. A cell with its centre farther than band_mm from the surface has none. Which have one, by bit.
  std::uint32_t List(const Eigen::Vector3d* centres_mm, std::size_t count, double radius_mm, double band_mm,
                     CandidateLists* lists);

 private:
  void Measure(const Eigen::Vector3d* centres_mm, std::size_t count, const Eigen::Vector3d& middle_mm, double width_mm);
  // How far the centre is from the surface at most, or more than band_mm.
  double FarthestOf(std::size_t lane, const Eigen::Vector3d& centre_mm, double band_mm) const;
  float DistanceOf(std::uint32_t item, const Eigen::Vector3d& centre_mm) const;
  void ListOne(std::size_t lane, const Eigen::Vector3d& centre_mm, double reach_mm, CandidateLists* lists);

  struct ListedItem {
    std::uint32_t item, step;
    float at_least_mm;
  };

  const TriangleTree& tree_;
  const std::vector<TriangleShape>& shapes_;
  std::uint32_t hint_ = NearestTriangle::kNone;
  std::vector<std::uint32_t> items_;
  std::vector<float> tolerances_mm_;  // of each item's distances
  float greatest_tolerance_mm_ = 0;
  NearLanes lanes_;
  std::vector<LaneBlock> squared_;  // by item, the centres side by side
  std::vector<ListedItem> listed_;
  std::vector<std::uint32_t> in_order_;  // of one cell
  std::vector<float> group_distance_mm_;
};

}  // namespace sixpoint::metrology
