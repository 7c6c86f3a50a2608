// The only topology of a mesh: which triangles meet along which edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

// One triangle's side of an edge.
struct EdgeSide {
  std::uint32_t low, high;  // its vertices, low < high
  std::uint32_t triangle;
  std::uint8_t opposite;  // the triangle's corner that is not on it
  bool forward;           // the triangle runs along it from low to high
  std::uint32_t from() const { return forward ? low : high; }
  std::uint32_t to() const { return forward ? high : low; }
};

// Of all triangles, edge after edge (by low, then high), those of an edge by triangle. A side from a vertex to itself is none.
std::vector<EdgeSide> EdgeSidesOf(const std::vector<TriangleCorners>& triangles);

// visit(sides, count) for each edge in order, `count` triangles meeting there.
template <typename Visit>
void ForEachEdge(const std::vector<EdgeSide>& sides, const Visit& visit) {
  for (std::size_t begin = 0, end; begin < sides.size(); begin = end) {
    for (end = begin + 1;
         end < sides.size() && sides[end].low == sides[begin].low && sides[end].high == sides[begin].high;)
      ++end;
    visit(&sides[begin], end - begin);
  }
}

// Two triangles meet there and go round it in opposite senses, as those of a body's skin do.
inline bool IsWhole(const EdgeSide* sides, std::size_t count) {
  return count == 2 && sides[0].forward != sides[1].forward;
}

}  // namespace sixpoint::metrology
