#include "metrology/sections/chords.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

bool BesideGap(const Outline& outline, std::size_t i) {
  return outline.nodes()[i].before == Join::kGap || outline.JoinAfter(i) == Join::kGap;
}

// Nodes on the convex hull, counter-clockwise from the lowest x (Andrew's monotone chain).
std::vector<std::size_t> HullOf(const Outline& outline) {
  const auto& nodes = outline.nodes();
  std::vector<std::size_t> order(nodes.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const Vector2d &p = nodes[a].point_mm, &q = nodes[b].point_mm;
    return p.x() != q.x() ? p.x() < q.x() : p.y() < q.y();
  });
  std::vector<std::size_t> hull;
  const auto add = [&](std::size_t i, std::size_t least) {
    while (hull.size() > least && Cross(nodes[hull.back()].point_mm - nodes[hull[hull.size() - 2]].point_mm,
                                        nodes[i].point_mm - nodes[hull.back()].point_mm) <= 0)
      hull.pop_back();
    hull.push_back(i);
  };
  for (const std::size_t i : order) add(i, 1);
  const std::size_t lower = hull.size();
  for (std::size_t k = order.size() - 1; k-- > 0;) add(order[k], lower);
  hull.pop_back();
  return hull;
}

// Where the outline is farthest along the direction, near a node.
Vector2d Contact(const Outline& outline, std::size_t near, const Vector2d& direction) {
  Vector2d found = outline.nodes()[near].point_mm;
  std::size_t i = outline.Previous(outline.Previous(near));
  for (int k = 0; k < 4; ++k, i = outline.Next(i)) {
    if (outline.JoinAfter(i) != Join::kSmooth) continue;
    double low = 0, high = 1;
    const auto rises = [&](double part) { return LeftOf(outline.NormalAt({i, part})).dot(direction) > 0; };
    if (!rises(low) || rises(high)) continue;
    for (int turn = 0; turn < 40; ++turn) (rises((low + high) / 2) ? low : high) = (low + high) / 2;
    const Vector2d point = outline.PointAt({i, low});
    if (point.dot(direction) > found.dot(direction)) found = point;
  }
  return found;
}

}  // namespace

FoundChord CaliperChord(const Outline& outline) {
  const std::vector<std::size_t> hull = HullOf(outline);
  double greatest = 0;
  std::size_t one = 0, other = 0;
  for (std::size_t a = 0; a < hull.size(); ++a)
    for (std::size_t b = a + 1; b < hull.size(); ++b) {
      const double squared = (outline.nodes()[hull[a]].point_mm - outline.nodes()[hull[b]].point_mm).squaredNorm();
      if (squared > greatest) greatest = squared, one = hull[a], other = hull[b];
    }
  if (BesideGap(outline, one) || BesideGap(outline, other)) return {std::nullopt, ChordFault::kContactNotSeen};
  Vector2d p = outline.nodes()[one].point_mm, q = outline.nodes()[other].point_mm;
  for (int turn = 0; turn < 20; ++turn) {
    const Vector2d along = (q - p).normalized();
    p = Contact(outline, one, -along);
    q = Contact(outline, other, along);
  }
  return {Chord{(q - p).norm(), (q - p).normalized()}, ChordFault::kNone};
}

FoundChord TangentChord(const Outline& outline, const Camber& camber) {
  const Vector2d from = camber.leading.place ? camber.leading.tip_mm : camber.leading.last_mm;
  const Vector2d to = camber.trailing.place ? camber.trailing.tip_mm : camber.trailing.last_mm;
  const double chord_mm = (to - from).norm();
  constexpr double kSymmetrical = 1e-3, kLeastBridge = 0.25;  // of the chord
  if (std::abs(camber.bow_mm) < kSymmetrical * chord_mm) return {std::nullopt, ChordFault::kNoDoubleTangent};
  const Vector2d hollow = (camber.bow_mm > 0 ? -1 : 1) * LeftOf(Vector2d((to - from) / chord_mm));
  const std::vector<std::size_t> hull = HullOf(outline);
  double longest = kLeastBridge * chord_mm;
  std::size_t one = 0, other = 0;
  for (std::size_t k = 0; k < hull.size(); ++k) {
    const std::size_t a = hull[k], b = hull[(k + 1) % hull.size()];
    const Vector2d bridge = outline.nodes()[b].point_mm - outline.nodes()[a].point_mm;
    if (bridge.norm() < longest || (-LeftOf(bridge)).dot(hollow) < 0.5 * bridge.norm()) continue;
    longest = bridge.norm();
    one = a;
    other = b;
  }
  if (one == other) return {std::nullopt, ChordFault::kNoDoubleTangent};
  if (BesideGap(outline, one) || BesideGap(outline, other)) return {std::nullopt, ChordFault::kContactNotSeen};
  Vector2d p = outline.nodes()[one].point_mm, q = outline.nodes()[other].point_mm;
  for (int turn = 0; turn < 20; ++turn) {
    const Vector2d outward = -LeftOf(Vector2d((q - p).normalized()));
    p = Contact(outline, one, outward);
    q = Contact(outline, other, outward);
  }
  const Vector2d along = (q - p).normalized();
  const auto first = outline.Farthest(-along), last = outline.Farthest(along);
  if (!first || !last) return {std::nullopt, ChordFault::kContactNotSeen};
  return {Chord{(outline.PointAt(*last) - outline.PointAt(*first)).dot(along), along}, ChordFault::kNone};
}

}  // namespace sixpoint::metrology
