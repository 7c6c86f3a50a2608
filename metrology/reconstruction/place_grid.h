// Places in space by cells, for what is near.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace sixpoint::metrology {

class PlaceGrid {
 public:
  explicit PlaceGrid(double reach_mm) : reach_mm_(reach_mm) {}

  void Add(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& normal) {
    cells_[KeyOf(CellOf(place_mm))].push_back({place_mm, normal, count_++});
  }
  // take(index, place, distance) of each within the reach that looks the same way, its normal within the angle of this cosine; the index counts
  // what was added. Their order depends on nothing but the places.
  template <typename Take>
  void EachNear(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& normal, double least_cosine,
                const Take& take) const {
    const Cell middle = CellOf(place_mm);
    for (std::int64_t x = -1; x <= 1; ++x)
      for (std::int64_t y = -1; y <= 1; ++y)
        for (std::int64_t z = -1; z <= 1; ++z) {
          const auto found = cells_.find(KeyOf(middle + Cell(x, y, z)));
          if (found == cells_.end()) continue;
          for (const Entry& entry : found->second) {
            const double distance_mm = (entry.place_mm - place_mm).norm();
            if (distance_mm < reach_mm_ && entry.normal.dot(normal) > least_cosine)
              take(entry.index, entry.place_mm, distance_mm);
          }
        }
  }
  // Distance of the nearest that looks the same way, its normal within the angle of this cosine; the reach where none is within it.
  double Nearest(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& normal, double least_cosine) const {
    double nearest_mm = reach_mm_;
    EachNear(place_mm, normal, least_cosine, [&](std::size_t, const Eigen::Vector3d&, double distance_mm) {
      nearest_mm = std::min(nearest_mm, distance_mm);
    });
    return nearest_mm;
  }
  // Whether one is within the reach.
  bool Has(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& normal, double least_cosine) const {
    return Nearest(place_mm, normal, least_cosine) < reach_mm_;
  }

 private:
  using Cell = Eigen::Matrix<std::int64_t, 3, 1>;
  struct Entry {
    Eigen::Vector3d place_mm, normal;
    std::size_t index;
  };
  Cell CellOf(const Eigen::Vector3d& place_mm) const {
    return (place_mm / reach_mm_).array().floor().matrix().cast<std::int64_t>();
  }
  // 21 bits each: cells of a tenth of a millimetre reach a hundred metres.
  static std::uint64_t KeyOf(const Cell& cell) {
    constexpr std::uint64_t kBits = (1U << 21U) - 1;
    return (static_cast<std::uint64_t>(cell.x()) & kBits) | (static_cast<std::uint64_t>(cell.y()) & kBits) << 21U |
           (static_cast<std::uint64_t>(cell.z()) & kBits) << 42U;
  }

  double reach_mm_;
  std::size_t count_ = 0;
  std::unordered_map<std::uint64_t, std::vector<Entry>> cells_;
};

}  // namespace sixpoint::metrology
