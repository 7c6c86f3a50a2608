#include "metrology/sections/outline.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

// Ends' derivatives of a cubic over [0, 1] that follows a circle by the sixth power of its angle.
struct Cubic {
  Vector2d p, q, at_p, at_q;
  Cubic(const OutlineNode& one, const OutlineNode& other) : p(one.point_mm), q(other.point_mm) {
    const double cosine = std::clamp(one.normal.dot(other.normal), -1.0, 1.0);
    const double half = std::sqrt((1 + cosine) / 2);  // cos(angle / 2)
    const double magnitude = (q - p).norm() * 2 / (1 + half);
    at_p = magnitude * LeftOf(one.normal);
    at_q = magnitude * LeftOf(other.normal);
  }
  Vector2d Point(double t) const {
    const double u = 1 - t;
    return u * u * (1 + 2 * t) * p + t * t * (3 - 2 * t) * q + t * u * u * at_p - t * t * u * at_q;
  }
  Vector2d Derivative(double t) const {
    return 6 * t * (1 - t) * (q - p) + (1 - t) * (1 - 3 * t) * at_p + t * (3 * t - 2) * at_q;
  }
};

double ArcLength(const OutlineNode& one, const OutlineNode& other) {
  const double angle = std::acos(std::clamp(one.normal.dot(other.normal), -1.0, 1.0));
  const double chord = (other.point_mm - one.point_mm).norm();
  return angle < 1e-6 ? chord : chord * (angle / 2) / std::sin(angle / 2);
}

}  // namespace

Outline::Outline(std::vector<OutlineNode> nodes) : nodes_(std::move(nodes)) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    nodes_[i].at_mm = length_mm_;
    const OutlineNode& next = nodes_[Next(i)];
    if (next.before == Join::kSmooth) length_mm_ += ArcLength(nodes_[i], next);
    if (next.before == Join::kGap) {
      length_mm_ += (next.point_mm - nodes_[i].point_mm).norm();
      gap_length_mm_ += (next.point_mm - nodes_[i].point_mm).norm();
    }
  }
}

Vector2d Outline::PointAt(const OutlinePlace& place) const {
  const OutlineNode& one = nodes_[place.node];
  const OutlineNode& next = nodes_[Next(place.node)];
  if (next.before != Join::kSmooth) return (1 - place.part) * one.point_mm + place.part * next.point_mm;
  return Cubic(one, next).Point(place.part);
}

Vector2d Outline::NormalAt(const OutlinePlace& place) const {
  const OutlineNode& one = nodes_[place.node];
  const OutlineNode& next = nodes_[Next(place.node)];
  if (next.before != Join::kSmooth) return place.part < 0.5 ? one.normal : next.normal;
  const Vector2d along = Cubic(one, next).Derivative(place.part);
  return -LeftOf(along).normalized();
}

double Outline::At(const OutlinePlace& place) const {
  const double from = nodes_[place.node].at_mm;
  const double to = place.node + 1 == nodes_.size() ? length_mm_ : nodes_[place.node + 1].at_mm;
  return from + place.part * (to - from);
}

OutlinePlace Outline::PlaceAt(double at_mm) const {
  at_mm -= length_mm_ * std::floor(at_mm / length_mm_);
  auto after = std::upper_bound(nodes_.begin(), nodes_.end(), at_mm,
                                [](double at, const OutlineNode& node) { return at < node.at_mm; });
  const std::size_t i = after == nodes_.begin() ? 0 : static_cast<std::size_t>(after - nodes_.begin()) - 1;
  const double to = i + 1 == nodes_.size() ? length_mm_ : nodes_[i + 1].at_mm;
  const double span = to - nodes_[i].at_mm;
  return {i, span > 0 ? std::clamp((at_mm - nodes_[i].at_mm) / span, 0.0, 1.0) : 0};
}

std::optional<OutlinePlace> Outline::Farthest(const Vector2d& direction) const {
  std::size_t best = 0;
  for (std::size_t i = 1; i < nodes_.size(); ++i)
    if (nodes_[i].point_mm.dot(direction) > nodes_[best].point_mm.dot(direction)) best = i;
  if (nodes_[best].before == Join::kGap || JoinAfter(best) == Join::kGap) return std::nullopt;
  // Where the curve runs across the direction, on either side of the node.
  OutlinePlace found{best, 0};
  for (const std::size_t i : {Previous(best), best}) {
    if (JoinAfter(i) != Join::kSmooth) continue;
    double low = 0, high = 1;
    const auto rises = [&](double part) { return LeftOf(NormalAt({i, part})).dot(direction) > 0; };
    if (!rises(low) || rises(high)) continue;
    for (int k = 0; k < 40; ++k) (rises((low + high) / 2) ? low : high) = (low + high) / 2;
    if (PointAt({i, low}).dot(direction) > PointAt(found).dot(direction)) found = {i, low};
  }
  return found;
}

OutlinePlace Outline::Nearest(const Vector2d& point_mm) const {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const double squared = (nodes_[i].point_mm - point_mm).squaredNorm();
    if (squared < least) least = squared, best = i;
  }
  OutlinePlace found{best, 0};
  for (const std::size_t i : {Previous(best), best}) {
    if (JoinAfter(i) != Join::kSmooth) continue;
    double low = 0, high = 1;
    const auto before = [&](double part) { return LeftOf(NormalAt({i, part})).dot(point_mm - PointAt({i, part})) > 0; };
    if (!before(low) || before(high)) continue;
    for (int k = 0; k < 40; ++k) (before((low + high) / 2) ? low : high) = (low + high) / 2;
    const double squared = (PointAt({i, low}) - point_mm).squaredNorm();
    if (squared < least) least = squared, found = {i, low};
  }
  return found;
}

Outline Outline::Offset(const std::vector<double>& offsets_mm, const std::vector<double>& slopes) const {
  std::vector<OutlineNode> moved = nodes_;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    moved[i].point_mm += offsets_mm[i] * nodes_[i].normal;
    moved[i].normal = (nodes_[i].normal - slopes[i] * LeftOf(nodes_[i].normal)).normalized();
  }
  for (std::size_t i = 0; i < moved.size(); ++i) {
    if (nodes_[i].before != Join::kCorner) continue;
    const std::size_t last = Previous(i);
    Eigen::Matrix2d normals;
    normals << nodes_[last].normal.transpose(), nodes_[i].normal.transpose();
    const double across = normals.determinant();
    if (std::abs(across) < 0.1) continue;
    const Vector2d wanted(offsets_mm[last], offsets_mm[i]);
    const Vector2d by((normals(1, 1) * wanted[0] - normals(0, 1) * wanted[1]) / across,
                      (normals(0, 0) * wanted[1] - normals(1, 0) * wanted[0]) / across);
    moved[i].point_mm = moved[last].point_mm = nodes_[i].point_mm + by;
  }
  return Outline(std::move(moved));
}

}  // namespace sixpoint::metrology
