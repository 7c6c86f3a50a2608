#include "metrology/repair/outline_sides.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr double kLeastApart = 0.1;  // contacts, in radii: below it they are about one place
constexpr double kLeastSlope = 0.05;
constexpr double kSettled_mm = 1e-7;  // of the difference of both distances

}  // namespace

SideDistance OutlineSides::From(double from_mm, double to_mm, const Vector2d& point_mm) const {
  if (to_mm < from_mm) to_mm += outline_.length_mm();
  const auto at = [&](double along_mm) { return outline_.PointAt(outline_.PlaceAt(along_mm)); };
  double least = std::numeric_limits<double>::infinity(), before_mm = from_mm, best_mm = from_mm, after_mm = from_mm;
  double previous_mm = from_mm;
  bool was_best = false;
  const auto look = [&](double along_mm, const Vector2d& place_mm) {
    const double squared = (place_mm - point_mm).squaredNorm();
    if (was_best) after_mm = along_mm, was_best = false;
    if (squared < least) least = squared, before_mm = previous_mm, best_mm = after_mm = along_mm, was_best = true;
    previous_mm = along_mm;
  };
  look(from_mm, at(from_mm));
  const std::size_t first = outline_.PlaceAt(from_mm).node;
  for (std::size_t k = 1; k <= outline_.size(); ++k) {
    const OutlineNode& node = outline_.nodes()[(first + k) % outline_.size()];
    const double along_mm = node.at_mm < from_mm ? node.at_mm + outline_.length_mm() : node.at_mm;
    if (along_mm >= to_mm) break;
    look(along_mm, node.point_mm);
  }
  look(to_mm, at(to_mm));
  // Between its neighbours: where the way to the point is across the outline.
  double low = before_mm, high = after_mm;
  for (int turn = 0; turn < 40 && high - low > 1e-10; ++turn) {
    const OutlinePlace middle = outline_.PlaceAt((low + high) / 2);
    const bool ahead = LeftOf(outline_.NormalAt(middle)).dot(point_mm - outline_.PointAt(middle)) > 0;
    (ahead ? low : high) = (low + high) / 2;
  }
  SideDistance found{std::sqrt(least), at(best_mm)};
  const Vector2d refined = at((low + high) / 2);
  if ((refined - point_mm).norm() < found.distance_mm) found = {(refined - point_mm).norm(), refined};
  return found;
}

std::optional<OutlineSides::Middle> OutlineSides::MiddleNear(const Vector2d& point_mm, const Vector2d& across,
                                                             double reach_mm) const {
  // The difference grows along `across` on one side of the middle; halving holds where a contact jumps.
  double low = -reach_mm, high = reach_mm, x = 0;
  for (int turn = 0; turn < 24; ++turn) {
    const Vector2d centre_mm = point_mm + x * across;
    const SideDistance one = FromFirst(centre_mm), other = FromSecond(centre_mm);
    if ((one.contact_mm - other.contact_mm).norm() < kLeastApart * one.distance_mm) return std::nullopt;
    const double difference = one.distance_mm - other.distance_mm;
    const double slope =
        across.dot((centre_mm - one.contact_mm) / one.distance_mm - (centre_mm - other.contact_mm) / other.distance_mm);
    if (!(std::abs(slope) > kLeastSlope)) return std::nullopt;
    if (std::abs(difference) < kSettled_mm) return Middle{centre_mm, (one.distance_mm + other.distance_mm) / 2};
    (difference / slope > 0 ? high : low) = x;
    const double newton = x - difference / slope;
    x = newton > low && newton < high && turn % 4 != 3 ? newton : (low + high) / 2;
    if (high - low < kSettled_mm) break;
  }
  return std::nullopt;
}

}  // namespace sixpoint::metrology
