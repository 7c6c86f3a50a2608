// A surface in the colours of its deviations, from fixed sides.
//
// Part frame, mm. Straight views without perspective, all of one scale; what is hidden is not drawn. Shaded by how far a face is turned away:
// one that looks at the viewer has exactly the scale's colour. What was not seen is dark and hatched, never grey like 0. The same
// input gives the same points. Not parallel; how fast: docs/report.md.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "report/report.h"

namespace sixpoint::report {

struct DeviationSurface {
  std::vector<std::array<float, 3>> vertices_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<float> deviations_um;  // positive outside; NaN: not seen
  std::vector<std::uint32_t>
      deviation_of;  // of each triangle, which of these is its; empty: they are as many as triangles
};

// From which side the viewer looks: from the front, he looks along +y, with x to his right and z up. From above y is up, from below -y.
enum class Side { kFront, kBack, kLeft, kRight, kTop, kBottom };
std::string NameOf(Side side);

struct PictureOptions {
  std::vector<Side> sides = {Side::kFront, Side::kRight, Side::kBack, Side::kLeft};
  int longest_px = 700;                // of the part's longest extent, 16 to 2000
  double scale_um = 50, band_um = 10;  // 0 <= band <= scale, scale > 0
};

inline constexpr std::size_t kMostTriangles = 8'000'000;

// INVALID_ARGUMENT: no triangle, too many, one of a vertex or a deviation that there is not, vertices that are not finite or beyond 1e6, no
// extent, sides that are none or more than six, numbers outside the bounds above.
absl::StatusOr<DeviationPicture> DrawDeviation(const DeviationSurface& surface, const PictureOptions& options);

}  // namespace sixpoint::report
