#include "metrology/milling/removal.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "metrology/milling/point_cells.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// Heights at which a line lies within a round body.
struct Stretch {
  double low = 0, high = 0;
};

std::optional<Stretch> InBall(const Dexel& dexel, const Vector3d& centre_mm, double radius_mm) {
  const Vector3d off = centre_mm - dexel.base_mm;
  const double middle = off.dot(dexel.normal), inside = radius_mm * radius_mm - off.squaredNorm() + middle * middle;
  if (inside < 0) return std::nullopt;
  return Stretch{middle - std::sqrt(inside), middle + std::sqrt(inside)};
}

// Of the cylinder from one place to another, without ends.
std::optional<Stretch> InCylinder(const Dexel& dexel, const Vector3d& from_mm, const Vector3d& to_mm,
                                  double radius_mm) {
  const double length_mm = (to_mm - from_mm).norm();
  if (!(length_mm > 0)) return std::nullopt;
  const Vector3d axis = (to_mm - from_mm) / length_mm, off = dexel.base_mm - from_mm;
  const double slope = axis.dot(dexel.normal), at = axis.dot(off);
  const Vector3d across = dexel.normal - slope * axis, off_across = off - at * axis;
  const double a = across.squaredNorm(), b = across.dot(off_across),
               c = off_across.squaredNorm() - radius_mm * radius_mm;
  Stretch stretch{-1e30, 1e30};
  if (a > 1e-18) {
    const double inside = b * b - a * c;
    if (inside < 0) return std::nullopt;
    stretch = {(-b - std::sqrt(inside)) / a, (-b + std::sqrt(inside)) / a};
  } else if (c > 0) {
    return std::nullopt;
  }
  // Between both ends of the axis.
  if (std::abs(slope) > 1e-12) {
    const double one = -at / slope, other = (length_mm - at) / slope;
    stretch.low = std::max(stretch.low, std::min(one, other));
    stretch.high = std::min(stretch.high, std::max(one, other));
  } else if (at < 0 || at > length_mm) {
    return std::nullopt;
  }
  if (stretch.low > stretch.high) return std::nullopt;
  return stretch;
}

// A stretch takes what is above its low end: what would stand above a tool falls off.
void Lower(const std::optional<Stretch>& stretch, double depth_mm, double* top_mm, bool* touched) {
  if (!stretch || stretch->high < -depth_mm || stretch->low >= *top_mm) return;
  *top_mm = std::max(-depth_mm, stretch->low);
  *touched = true;
}

// One stretch of the path.
struct Way {
  Vector3d from_mm, to_mm, axis;
};

}  // namespace

Removal Remove(const std::vector<Dexel>& dexels, const RecontourPath& path, const BallMill& mill, double depth_mm,
               int thread_count) {
  std::vector<Way> ways;
  Points centres_mm, shank_mm;
  std::vector<std::uint32_t> shank_way;
  double longest_mm = 0;
  for (const RecontourPass& pass : path.passes)
    for (std::size_t i = 0; i < pass.places.size(); ++i) {
      const ToolPlace& place = pass.places[i];
      const Way way{place.centre_mm, pass.places[(i + 1) % pass.places.size()].centre_mm, place.axis};
      longest_mm = std::max(longest_mm, (way.to_mm - way.from_mm).norm());
      ways.push_back(way);
      centres_mm.push_back((way.from_mm + way.to_mm) / 2);
    }
  // Points along each shank, a radius apart: which shanks are near a dexel.
  for (std::size_t w = 0; w < ways.size(); ++w)
    for (double at_mm = mill.radius_mm; at_mm < mill.length_mm; at_mm += mill.radius_mm) {
      shank_mm.push_back(ways[w].from_mm + at_mm * ways[w].axis);
      shank_way.push_back(static_cast<std::uint32_t>(w));
    }
  const PointCells balls(centres_mm, mill.radius_mm), shanks(shank_mm, mill.radius_mm);
  Removal removal;
  removal.top_mm.resize(dexels.size());
  std::vector<std::uint8_t> touched(dexels.size(), 0);
  ForEachChunk(dexels.size(), 256, thread_count, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t d = begin; d < end; ++d) {
      const Dexel& dexel = dexels[d];
      double top_mm = dexel.top_mm;
      bool cut = false;
      Eigen::AlignedBox3d box(dexel.base_mm - depth_mm * dexel.normal);
      box.extend(dexel.base_mm - depth_mm * dexel.normal).extend(dexel.base_mm + dexel.top_mm * dexel.normal);
      const auto about = [&](double reach_mm) {
        const Vector3d reach = Vector3d::Constant(reach_mm);
        return Eigen::AlignedBox3d(box.min() - reach, box.max() + reach);
      };
      balls.In(about(mill.radius_mm + longest_mm / 2), [&](std::size_t w) {
        Lower(InBall(dexel, ways[w].from_mm, mill.radius_mm), depth_mm, &top_mm, &cut);
        Lower(InCylinder(dexel, ways[w].from_mm, ways[w].to_mm, mill.radius_mm), depth_mm, &top_mm, &cut);
      });
      shanks.In(about(1.5 * mill.radius_mm), [&](std::size_t s) {
        const Way& way = ways[shank_way[s]];
        Lower(InCylinder(dexel, way.from_mm, way.from_mm + mill.length_mm * way.axis, mill.radius_mm), depth_mm,
              &top_mm, &cut);
      });
      removal.top_mm[d] = top_mm;
      touched[d] = cut ? 1 : 0;
    }
  });
  for (const std::uint8_t one : touched) removal.touched_count += one;
  return removal;
}

}  // namespace sixpoint::metrology
