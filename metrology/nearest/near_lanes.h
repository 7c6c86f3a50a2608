// Points side by side, measured against one triangle at a time in single precision: only to rule out what is farther than the
// best by more than that rounds (ToleranceOf). One loop, compiled for each width of vectors, where a product and its sum are rounded once if
// the processor can: widths may differ by that rounding, and what is found, which double precision decides, does not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "metrology/parallel/lane_width.h"

namespace sixpoint::metrology {

// What a triangle looks like in single precision, wherever it stands: one line of the processor's cache.
struct alignas(64) TriangleShape {
  float bx, by, bz, cx, cy, cz, nx, ny, nz;  // edges, unit normal
  float vx, vy, vz, wx, wy, wz;              // barycentric coordinates of p - corner: its products with these
  float rounding;                            // of a distance, for each millimetre from the corner
};

struct NearLanes {
  static constexpr std::size_t kMost = 64;
  static constexpr std::size_t kMultiple = 16;     // points are padded to a multiple, of the widest vectors
  alignas(64) float x[kMost], y[kMost], z[kMost];  // about some centre
  alignas(64) float least[kMost], second[kMost];   // squared distances
  alignas(64) std::uint32_t nearest[kMost];        // candidate

  // A point that nothing was measured against yet.
  void Set(std::size_t lane, float px, float py, float pz) {
    x[lane] = px;
    y[lane] = py;
    z[lane] = pz;
    least[lane] = second[lane] = std::numeric_limits<float>::infinity();
    nearest[lane] = 0;
  }
};

// Squared distances, as many as are measured together.
struct alignas(64) LaneBlock {
  float at[NearLanes::kMultiple];
};

// Puts the squared distances of the first `count` lanes (and of those after them that fill a vector) to a triangle with its first corner
// at (ax, ay, az), and keeps the least and second of each lane.
using MeasureTriangle = void (*)(const TriangleShape& shape, float ax, float ay, float az, std::uint32_t candidate,
                                 std::size_t count, NearLanes* lanes, LaneBlock* squared);
MeasureTriangle MeasureOf(LaneWidth width);

}  // namespace sixpoint::metrology
