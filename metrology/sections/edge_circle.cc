#include "metrology/sections/edge_circle.h"

#include <cmath>
#include <vector>

#include "metrology/sections/circle_fit.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

// How far from the tip, along the outline, normals stay within the limit; forward or backward.
std::optional<double> ReachOf(const Outline& outline, const SectionEnd& end, bool forward) {
  const double from = outline.At(*end.place);
  const auto within = [&](const OutlinePlace& place) {
    return outline.NormalAt(place).dot(end.outward) >= kEdgeNormalCosine;
  };
  std::size_t i = end.place->node;
  for (std::size_t count = 0; count < outline.size(); ++count) {
    if (outline.JoinAfter(i) != Join::kSmooth) return std::nullopt;
    const OutlinePlace far{i, forward ? 1.0 : 0.0};
    if (!within(far)) {
      double in = count == 0 ? end.place->part : 1 - far.part, out = far.part;
      for (int k = 0; k < 40; ++k) (within({i, (in + out) / 2}) ? in : out) = (in + out) / 2;
      return std::abs(std::remainder(outline.At({i, in}) - from, outline.length_mm()));
    }
    i = forward ? outline.Next(i) : outline.Previous(i);
  }
  return std::nullopt;
}

}  // namespace

std::optional<EdgeCircle> EdgeCircleOf(const Outline& outline, const SectionEnd& end) {
  if (end.kind != EndKind::kRound || !end.place) return std::nullopt;
  const auto ahead = ReachOf(outline, end, true), behind = ReachOf(outline, end, false);
  if (!ahead || !behind) return std::nullopt;
  constexpr int kPlaces = 60;
  std::vector<Vector2d> points;
  const double from = outline.At(*end.place) - *behind, step = (*ahead + *behind) / kPlaces;
  for (int k = 0; k <= kPlaces; ++k) points.push_back(outline.PointAt(outline.PlaceAt(from + k * step)));
  const FittedCircle fitted = FitCircle(points);
  if (!std::isfinite(fitted.radius_mm)) return std::nullopt;
  return EdgeCircle{fitted.centre_mm, fitted.radius_mm, fitted.greatest_mm - fitted.least_mm};
}

}  // namespace sixpoint::metrology
