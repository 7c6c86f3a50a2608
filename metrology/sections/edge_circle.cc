#include "metrology/sections/edge_circle.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

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
  // Linear in centre and r^2 - |c|^2 first, then by the distances themselves.
  const Vector2d origin = end.tip_mm;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Vector2d& point : points) {
    const Vector2d p = point - origin;
    const Eigen::Vector3d row(2 * p.x(), 2 * p.y(), 1);
    normal += row * row.transpose();
    right += p.squaredNorm() * row;
  }
  const Eigen::Vector3d solved = normal.ldlt().solve(right);
  EdgeCircle circle;
  circle.centre_mm = origin + solved.head<2>();
  circle.radius_mm = std::sqrt(std::max(0.0, solved[2] + solved.head<2>().squaredNorm()));
  for (int turn = 0; turn < 8; ++turn) {
    normal.setZero();
    right.setZero();
    for (const Vector2d& point : points) {
      const Vector2d off = point - circle.centre_mm;
      const Eigen::Vector3d row(off.x() / off.norm(), off.y() / off.norm(), 1);
      normal += row * row.transpose();
      right += (off.norm() - circle.radius_mm) * row;
    }
    const Eigen::Vector3d by = normal.ldlt().solve(right);
    circle.centre_mm += by.head<2>();
    circle.radius_mm += by[2];
  }
  double least = INFINITY, greatest = -INFINITY;
  for (const Vector2d& point : points) {
    const double off = (point - circle.centre_mm).norm() - circle.radius_mm;
    least = std::min(least, off);
    greatest = std::max(greatest, off);
  }
  circle.form_mm = greatest - least;
  return circle;
}

}  // namespace sixpoint::metrology
