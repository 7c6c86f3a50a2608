#include "report/deviation_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "refusal/refusal.h"
#include "report/colour_scale.h"
#include "report/triangle_raster.h"

namespace sixpoint::report {
namespace {

constexpr double kFarthest_mm = 1e6;
constexpr int kMargin_px = 3;

// Rows: right, up, towards the viewer.
using View = std::array<std::array<float, 3>, 3>;

View ViewFrom(Side side) {
  switch (side) {
    case Side::kFront:
      return {{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}};
    case Side::kBack:
      return {{{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}}};
    case Side::kLeft:
      return {{{0, -1, 0}, {0, 0, 1}, {-1, 0, 0}}};
    case Side::kRight:
      return {{{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}};
    case Side::kTop:
      return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    case Side::kBottom:
      return {{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
  }
  return {};
}

std::array<float, 3> Seen(const View& view, const std::array<float, 3>& p) {
  std::array<float, 3> seen{};
  for (std::size_t i = 0; i < 3; ++i) seen[i] = view[i][0] * p[0] + view[i][1] * p[1] + view[i][2] * p[2];
  return seen;
}

absl::Status CheckSurface(const DeviationSurface& surface) {
  const std::size_t count = surface.triangles.size();
  if (count == 0 || count > kMostTriangles)
    return Refuse("triangles", std::to_string(count), "1 to " + std::to_string(kMostTriangles));
  for (std::size_t i = 0; i < surface.vertices_mm.size(); ++i)
    for (const float x : surface.vertices_mm[i])
      if (!(std::abs(x) <= kFarthest_mm))
        return Refuse("vertices_mm[" + std::to_string(i) + "]", x, "finite, at most 1e6 from the origin");
  for (std::size_t i = 0; i < count; ++i)
    for (const std::uint32_t v : surface.triangles[i])
      if (v >= surface.vertices_mm.size())
        return Refuse("triangles[" + std::to_string(i) + "]", v,
                      "< " + std::to_string(surface.vertices_mm.size()) + ", the number of vertices");
  const std::size_t named = surface.deviation_of.empty() ? surface.deviations_um.size() : surface.deviation_of.size();
  if (named != count)
    return Refuse(surface.deviation_of.empty() ? "deviations_um" : "deviation_of", std::to_string(named),
                  "as many as triangles: " + std::to_string(count));
  for (std::size_t i = 0; i < surface.deviation_of.size(); ++i)
    if (surface.deviation_of[i] >= surface.deviations_um.size())
      return Refuse("deviation_of[" + std::to_string(i) + "]", surface.deviation_of[i],
                    "< " + std::to_string(surface.deviations_um.size()) + ", the number of deviations");
  return absl::OkStatus();
}

absl::Status CheckOptions(const PictureOptions& options) {
  Refusals refusals;
  if (options.sides.empty() || options.sides.size() > 6)
    refusals.Add(Refuse("sides", std::to_string(options.sides.size()), "1 to 6"));
  if (options.longest_px < 16 || options.longest_px > 2000)
    refusals.Add(Refuse("longest_px", options.longest_px, "16 to 2000"));
  if (!(options.scale_um > 0 && options.scale_um < 1e9))
    refusals.Add(Refuse("scale_um", options.scale_um, "> 0, finite"));
  if (!(options.band_um >= 0 && options.band_um <= options.scale_um))
    refusals.Add(Refuse("band_um", options.band_um, "0 to scale_um"));
  return refusals.status();
}

struct Extent {
  std::array<float, 3> least, greatest;
  float Along(std::size_t axis) const { return greatest[axis] - least[axis]; }
};

// Of what the triangles use: a mesh may hold vertices that stand far off and belong to none.
Extent ExtentOf(const DeviationSurface& surface) {
  constexpr float kFar = std::numeric_limits<float>::max();
  Extent extent{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  for (const auto& triangle : surface.triangles)
    for (const std::uint32_t v : triangle)
      for (std::size_t i = 0; i < 3; ++i) {
        extent.least[i] = std::min(extent.least[i], surface.vertices_mm[v][i]);
        extent.greatest[i] = std::max(extent.greatest[i], surface.vertices_mm[v][i]);
      }
  return extent;
}

}  // namespace

std::string NameOf(Side side) {
  switch (side) {
    case Side::kFront:
      return "front";
    case Side::kBack:
      return "back";
    case Side::kLeft:
      return "left";
    case Side::kRight:
      return "right";
    case Side::kTop:
      return "top";
    case Side::kBottom:
      return "bottom";
  }
  return "";
}

absl::StatusOr<DeviationPicture> DrawDeviation(const DeviationSurface& surface, const PictureOptions& options) {
  if (absl::Status status = CheckOptions(options); !status.ok()) return status;
  if (absl::Status status = CheckSurface(surface); !status.ok()) return status;
  const Extent extent = ExtentOf(surface);
  const float longest_mm = std::max({extent.Along(0), extent.Along(1), extent.Along(2)});
  if (!(longest_mm > 0)) return Refuse("vertices_mm", 0, "an extent");
  DeviationPicture drawn;
  drawn.scale_um = options.scale_um;
  drawn.band_um = options.band_um;
  drawn.mm_per_px = static_cast<double>(longest_mm) / options.longest_px;
  const float px_per_mm = static_cast<float>(kSupersampling / drawn.mm_per_px);
  std::vector<std::array<float, 3>> seen(surface.vertices_mm.size());
  for (const Side side : options.sides) {
    const View view = ViewFrom(side);
    // A view is turned by quarters, so that the extent's corners are those of the view.
    const std::array<float, 3> one = Seen(view, extent.least), other = Seen(view, extent.greatest);
    const float left = std::min(one[0], other[0]), top = std::max(one[1], other[1]);
    const auto side_px = [&](std::size_t i) {
      return 2 * kMargin_px + static_cast<int>(std::ceil(std::abs(one[i] - other[i]) / drawn.mm_per_px));
    };
    const float margin = kSupersampling * kMargin_px;
    for (std::size_t v = 0; v < seen.size(); ++v) {
      const std::array<float, 3> p = Seen(view, surface.vertices_mm[v]);
      seen[v] = {(p[0] - left) * px_per_mm + margin, (top - p[1]) * px_per_mm + margin, p[2] * px_per_mm};
    }
    TriangleRaster raster(side_px(0), side_px(1));
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      const auto& corners = surface.triangles[t];
      raster.Draw(static_cast<std::uint32_t>(t), seen[corners[0]], seen[corners[1]], seen[corners[2]]);
    }
    auto picture = std::make_shared<Picture>(raster.Coloured(
        [&](std::uint32_t t) {
          return surface.deviations_um[surface.deviation_of.empty() ? t : surface.deviation_of[t]];
        },
        seen, surface.triangles, options.scale_um, options.band_um));
    picture->name = NameOf(side);
    drawn.views.push_back(std::move(picture));
  }
  return drawn;
}

}  // namespace sixpoint::report
