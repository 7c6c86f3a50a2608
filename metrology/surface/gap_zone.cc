#include "metrology/surface/gap_zone.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Cell = std::array<std::int64_t, 3>;

Cell CellOf(const Eigen::Vector3d& point_mm) {
  Cell cell{};
  for (int k = 0; k < 3; ++k) cell[k] = static_cast<std::int64_t>(std::floor(point_mm[k] / GapZone::kReachMm));
  return cell;
}

// Coordinates of parts are within 10 km: 21 bits each hold 1 mm cells of a kilometre, and cells that share a key are told apart by distance.
std::uint64_t KeyOf(const Cell& cell) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << 21) - 1;
  std::uint64_t key = 0;
  for (const std::int64_t c : cell) key = key << 21 | (static_cast<std::uint64_t>(c) & kMask);
  return key;
}

}  // namespace

GapZone::GapZone(const TriangleMesh& mesh) {
  for (std::size_t v = 0; v < mesh.face_gaps_mm.size(); ++v) {
    if (!(mesh.face_gaps_mm[v] > 0)) continue;
    cells_[KeyOf(CellOf(mesh.vertices_mm[v]))].push_back({mesh.vertices_mm[v], mesh.face_gaps_mm[v]});
  }
  for (const auto& [key, gaps] : cells_) byte_count_ += sizeof(key) + sizeof(gaps) + gaps.capacity() * sizeof(Gap);
}

double GapZone::At(const Eigen::Vector3d& point_mm) const {
  if (cells_.empty() || !point_mm.allFinite()) return 0;
  const Cell middle = CellOf(point_mm);
  double greatest_mm = 0;
  for (std::int64_t x = -1; x <= 1; ++x)
    for (std::int64_t y = -1; y <= 1; ++y)
      for (std::int64_t z = -1; z <= 1; ++z) {
        const auto cell = cells_.find(KeyOf({middle[0] + x, middle[1] + y, middle[2] + z}));
        if (cell == cells_.end()) continue;
        for (const Gap& gap : cell->second)
          if (gap.gap_mm > greatest_mm && (gap.at_mm - point_mm).squaredNorm() <= kReachMm * kReachMm)
            greatest_mm = gap.gap_mm;
      }
  return greatest_mm;
}

}  // namespace sixpoint::metrology
