// Which triangle is seen at each place of a picture, and in which colour.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "report/picture.h"

namespace sixpoint::report {

inline constexpr int kSupersampling = 2;  // samples along each side of a point

// Screen coordinates in samples: x to the right, y down, z towards the viewer. The nearest is seen; of two as near the first.
class TriangleRaster {
 public:
  TriangleRaster(int width_px, int height_px);

  void Draw(std::uint32_t triangle, const std::array<float, 3>& a, const std::array<float, 3>& b,
            const std::array<float, 3>& c);

  // On white; shaded by the faces' normals, with a darker line where the surface ends or steps back.
  Picture Coloured(const std::function<float(std::uint32_t triangle)>& deviation_um,
                   const std::vector<std::array<float, 3>>& seen,
                   const std::vector<std::array<std::uint32_t, 3>>& triangles, double scale_um, double band_um) const;

 private:
  bool AtEdge(int x, int y) const;

  int width_, height_;  // in samples
  std::vector<float> depth_;
  std::vector<std::uint32_t> triangle_;
};

}  // namespace sixpoint::report
