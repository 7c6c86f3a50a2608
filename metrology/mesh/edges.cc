#include "metrology/mesh/edges.h"

#include <algorithm>
#include <tuple>

namespace sixpoint::metrology {

std::vector<EdgeSide> EdgeSidesOf(const std::vector<TriangleCorners>& triangles) {
  std::vector<EdgeSide> sides;
  sides.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::uint8_t i = 0; i < 3; ++i) {
      const std::uint32_t from = triangles[t][(i + 1) % 3], to = triangles[t][(i + 2) % 3];
      if (from != to) sides.push_back({std::min(from, to), std::max(from, to), t, i, from < to});
    }
  std::sort(sides.begin(), sides.end(), [](const EdgeSide& a, const EdgeSide& b) {
    return std::tie(a.low, a.high, a.triangle, a.opposite) < std::tie(b.low, b.high, b.triangle, b.opposite);
  });
  return sides;
}

}  // namespace sixpoint::metrology
