#include "report/triangle_raster.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "report/colour_scale.h"

namespace sixpoint::report {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr double kDarkest = 0.72;  // of a face that is seen from its edge: the scale's colour stays what it is
constexpr double kEdgeShade = 0.55;
constexpr float kStep = 12;  // samples in depth between neighbours from which on there is an edge
constexpr int kHatch_px = 6;

double Shade(const std::array<float, 3>& a, const std::array<float, 3>& b, const std::array<float, 3>& c) {
  const double ux = b[0] - a[0], uy = b[1] - a[1], uz = b[2] - a[2];
  const double vx = c[0] - a[0], vy = c[1] - a[1], vz = c[2] - a[2];
  const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
  const double length = std::sqrt(nx * nx + ny * ny + nz * nz);
  return length > 0 ? kDarkest + (1 - kDarkest) * std::abs(nz) / length : 1;
}

}  // namespace

TriangleRaster::TriangleRaster(int width_px, int height_px)
    : width_(kSupersampling * width_px), height_(kSupersampling * height_px) {
  const std::size_t samples = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  depth_.assign(samples, -std::numeric_limits<float>::infinity());
  triangle_.assign(samples, kNone);
}

void TriangleRaster::Draw(std::uint32_t triangle, const std::array<float, 3>& a, const std::array<float, 3>& b,
                          const std::array<float, 3>& c) {
  const float area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  if (area == 0) return;  // seen from its edge
  // Samples lie in the middle of their cells.
  const auto first = [](float least) { return static_cast<int>(std::ceil(least - 0.5f)); };
  const auto last = [](float greatest) { return static_cast<int>(std::floor(greatest - 0.5f)); };
  const int left = std::max(0, first(std::min({a[0], b[0], c[0]})));
  const int right = std::min(width_ - 1, last(std::max({a[0], b[0], c[0]})));
  const int top = std::max(0, first(std::min({a[1], b[1], c[1]})));
  const int bottom = std::min(height_ - 1, last(std::max({a[1], b[1], c[1]})));
  if (left > right || top > bottom) return;
  // Weights of b and c grow evenly along x and y. What lies on an edge, by the sums' rounding, belongs to both sides: no seam is open.
  constexpr float kSeam = 1e-5f;
  const float inverse = 1 / area;
  const float wb_x = (c[1] - a[1]) * inverse, wb_y = -(c[0] - a[0]) * inverse;
  const float wc_x = -(b[1] - a[1]) * inverse, wc_y = (b[0] - a[0]) * inverse;
  const float z_x = wb_x * (b[2] - a[2]) + wc_x * (c[2] - a[2]);
  const float z_y = wb_y * (b[2] - a[2]) + wc_y * (c[2] - a[2]);
  const auto depths = std::minmax({a[2], b[2], c[2]});
  for (int y = top; y <= bottom; ++y) {
    const float dy = static_cast<float>(y) + 0.5f - a[1];
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
    for (int x = left; x <= right; ++x) {
      const float dx = static_cast<float>(x) + 0.5f - a[0];
      const float wb = dx * wb_x + dy * wb_y, wc = dx * wc_x + dy * wc_y;
      if (wb < -kSeam || wc < -kSeam || wb + wc > 1 + kSeam) continue;
      const float z = std::clamp(a[2] + dx * z_x + dy * z_y, depths.first, depths.second);
      const std::size_t i = row + static_cast<std::size_t>(x);
      if (z > depth_[i]) {
        depth_[i] = z;
        triangle_[i] = triangle;
      }
    }
  }
}

bool TriangleRaster::AtEdge(int x, int y) const {
  const auto index = [this](int i, int j) {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(i);
  };
  const float z = depth_[index(x, y)];
  const int steps[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  for (const auto& step : steps) {
    const int i = x + step[0], j = y + step[1];
    if (i < 0 || j < 0 || i >= width_ || j >= height_) return true;
    if (triangle_[index(i, j)] == kNone || z - depth_[index(i, j)] > kStep) return true;
  }
  return false;
}

Picture TriangleRaster::Coloured(const std::function<float(std::uint32_t triangle)>& deviation_um,
                                 const std::vector<std::array<float, 3>>& seen,
                                 const std::vector<std::array<std::uint32_t, 3>>& triangles, double scale_um,
                                 double band_um) const {
  Picture picture;
  picture.width_px = width_ / kSupersampling;
  picture.height_px = height_ / kSupersampling;
  picture.rgb.reserve(3 * static_cast<std::size_t>(picture.width_px) * static_cast<std::size_t>(picture.height_px));
  const auto sample = [&](int x, int y, int hatch) -> std::array<double, 3> {
    const std::uint32_t t =
        triangle_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
    if (t == kNone) return {255, 255, 255};
    const float deviation = deviation_um(t);
    Colour colour = DeviationColour(deviation, scale_um, band_um);
    if (std::isnan(deviation) && hatch == 0) colour = kNotSeenHatch;
    const auto& corners = triangles[t];
    const double shade = (AtEdge(x, y) ? kEdgeShade : 1) * Shade(seen[corners[0]], seen[corners[1]], seen[corners[2]]);
    return {shade * colour.r, shade * colour.g, shade * colour.b};
  };
  for (int y = 0; y < picture.height_px; ++y)
    for (int x = 0; x < picture.width_px; ++x) {
      std::array<double, 3> sum{};
      for (int j = 0; j < kSupersampling; ++j)
        for (int i = 0; i < kSupersampling; ++i) {
          const auto one = sample(kSupersampling * x + i, kSupersampling * y + j, ((x + y) / kHatch_px) % 2);
          for (std::size_t k = 0; k < 3; ++k) sum[k] += one[k];
        }
      for (const double channel : sum)
        picture.rgb.push_back(static_cast<std::uint8_t>(std::lround(channel / (kSupersampling * kSupersampling))));
    }
  return picture;
}

}  // namespace sixpoint::report
