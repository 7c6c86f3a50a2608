// Which hole a point may belong to: the regions in which the pins of a part's holes must stand.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace sixpoint::metrology {

// About a hole's nominal axis; part frame.
struct HoleRegion {
  Eigen::Vector3d start_mm = Eigen::Vector3d::Zero();  // height 0
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     // unit, out of the part
  double radius_mm = 0;                                // points on it are outside
  double lowest_mm = 0, highest_mm = 0;                // heights along the axis; both inside
};

// Nearly all of a blade's points stand in no region: a grid of cells says at once which regions can hold a point, and only those are asked.
// Read by any number of threads.
class HoleRegions {
 public:
  explicit HoleRegions(std::vector<HoleRegion> regions);
  std::size_t size() const { return regions_.size(); }
  // The region that the point stands in, of several the one whose axis is nearest, the first of equals; none: size(). As if all
  // were asked in turn.
  std::size_t At(const Eigen::Vector3d& point_mm) const;

 private:
  std::size_t CellOf(const Eigen::Vector3d& point_mm) const;
  void MakeGrid();
  void MakeCells();

  std::vector<HoleRegion> regions_;
  Eigen::AlignedBox3d box_mm_;  // of all regions
  double cell_mm_ = 1;
  Eigen::Array3i counts_ = Eigen::Array3i::Zero();  // of cells, along x, y, z
  std::vector<std::uint32_t> first_;                // in listed_, of each cell; and the end
  std::vector<std::uint32_t> listed_;               // regions, in their order within a cell
};

}  // namespace sixpoint::metrology
