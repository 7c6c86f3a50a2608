#include "metrology/mesh/weld.h"

#include <cmath>
#include <cstring>
#include <unordered_map>

namespace sixpoint::metrology {
namespace {

struct Cell {
  std::int64_t x, y, z;
  bool operator==(const Cell& other) const { return x == other.x && y == other.y && z == other.z; }
};
struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t hash = 0;
    for (const std::int64_t value : {cell.x, cell.y, cell.z}) {
      hash = (hash ^ static_cast<std::uint64_t>(value)) * 0x9E3779B97F4A7C15ull;
      hash ^= hash >> 29;
    }
    return hash;
  }
};

Cell BitsOf(const Eigen::Vector3d& point) {
  const Eigen::Vector3d plain = point.array() + 0.0;  // -0 is 0
  Cell cell;
  std::memcpy(&cell, plain.data(), sizeof(cell));
  return cell;
}

std::vector<std::uint32_t> FirstEqual(const Points& points) {
  std::unordered_map<Cell, std::uint32_t, CellHash> first;
  first.reserve(points.size());
  std::vector<std::uint32_t> alike(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) alike[i] = first.emplace(BitsOf(points[i]), i).first->second;
  return alike;
}

// Cells as wide as the tolerance: what is near lies in one of the 27 about a point's own.
std::vector<std::uint32_t> FirstWithin(double tolerance_mm, const Points& points) {
  std::unordered_map<Cell, std::vector<std::uint32_t>, CellHash> cells;
  cells.reserve(points.size());
  const auto find = [&](std::uint32_t i) {
    const Eigen::Vector3d scaled = points[i] / tolerance_mm;
    const Cell home{std::llround(scaled.x()), std::llround(scaled.y()), std::llround(scaled.z())};
    for (std::int64_t x = home.x - 1; x <= home.x + 1; ++x)
      for (std::int64_t y = home.y - 1; y <= home.y + 1; ++y)
        for (std::int64_t z = home.z - 1; z <= home.z + 1; ++z) {
          const auto cell = cells.find({x, y, z});
          if (cell == cells.end()) continue;
          for (const std::uint32_t first : cell->second)
            if ((points[first] - points[i]).norm() <= tolerance_mm) return first;
        }
    cells[home].push_back(i);
    return i;
  };
  std::vector<std::uint32_t> alike(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) alike[i] = find(i);
  return alike;
}

}  // namespace

std::vector<std::uint32_t> FirstAlike(double tolerance_mm, const Points& points) {
  return tolerance_mm == 0 ? FirstEqual(points) : FirstWithin(tolerance_mm, points);
}

std::vector<std::uint32_t> Weld(double tolerance_mm, Points* points) {
  std::vector<std::uint32_t> new_index = FirstAlike(tolerance_mm, *points);
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < new_index.size(); ++i) {
    if (new_index[i] != i) {
      new_index[i] = new_index[new_index[i]];
    } else {
      (*points)[kept] = (*points)[i];
      new_index[i] = kept++;
    }
  }
  points->resize(kept);
  return new_index;
}

}  // namespace sixpoint::metrology
