#include "metrology/correction/mouth.h"

#include <absl/status/status.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "metrology/correction/segment_distance.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

constexpr std::size_t kPiecesOfStretch = 16;
constexpr double kRounding_mm = 1e-9;  // of a distance from a box beside one from a piece within it

// A vertex before the longest side.
std::size_t BeforeLongest(const Corners& corners) {
  std::size_t longest = 0;
  for (std::size_t i = 1; i < 3; ++i)
    if ((corners[(i + 1) % 3] - corners[i]).squaredNorm() >
        (corners[(longest + 1) % 3] - corners[longest]).squaredNorm())
      longest = i;
  return longest;
}

}  // namespace

TipLine::TipLine(Points tips_mm) : tips_mm_(std::move(tips_mm)) {
  for (const Vector3d& tip : tips_mm_) bounds_mm_.extend(tip);
  if (tips_mm_.size() == 1) tips_mm_.push_back(tips_mm_.front());
  for (std::size_t first = 0; first + 1 < tips_mm_.size(); first += kPiecesOfStretch) {
    Stretch& stretch = stretches_.emplace_back();
    stretch.first = first;
    stretch.end = std::min(first + kPiecesOfStretch, tips_mm_.size() - 1);
    for (std::size_t i = first; i <= stretch.end; ++i) stretch.bounds_mm.extend(tips_mm_[i]);
  }
}

double TipLine::DistanceMm(const Vector3d& point_mm) const {
  double least_mm = std::numeric_limits<double>::infinity();
  for (const Stretch& stretch : stretches_) {
    if (stretch.bounds_mm.exteriorDistance(point_mm) > least_mm + kRounding_mm) continue;
    for (std::size_t i = stretch.first; i < stretch.end; ++i)
      least_mm = std::fmin(least_mm, DistanceFromSegment(point_mm, tips_mm_[i], tips_mm_[i + 1]));
  }
  return least_mm;
}

// What is so near to a line is convex.
bool TipLine::Holds(const Corners& triangle_mm, double reach_mm) const {
  for (const Stretch& stretch : stretches_) {
    const auto is_far = [&](const Vector3d& corner) {
      return stretch.bounds_mm.exteriorDistance(corner) > reach_mm + kRounding_mm;
    };
    if (std::any_of(triangle_mm.begin(), triangle_mm.end(), is_far)) continue;
    for (std::size_t i = stretch.first; i < stretch.end; ++i)
      if (std::all_of(triangle_mm.begin(), triangle_mm.end(), [&](const Vector3d& corner) {
            return DistanceFromSegment(corner, tips_mm_[i], tips_mm_[i + 1]) <= reach_mm;
          }))
        return true;
  }
  return false;
}

absl::StatusOr<TriangleMesh> WithoutMouth(const TriangleMesh& mesh, const TipLine& line, double reach_mm,
                                          double piece_mm, const Eigen::AlignedBox3d& box_mm,
                                          const std::function<bool()>& keep_going) {
  constexpr std::size_t kPiecesPerQuestion = 256;
  int halvings = 0;
  std::size_t looks = 0;
  TriangleMesh without;
  const Eigen::AlignedBox3d mouth_box_mm(line.bounds_mm().min() - Vector3d::Constant(reach_mm),
                                         line.bounds_mm().max() + Vector3d::Constant(reach_mm));
  const auto keep = [&](const Corners& corners) {
    const auto first = static_cast<std::uint32_t>(without.vertices_mm.size());
    without.vertices_mm.insert(without.vertices_mm.end(), corners.begin(), corners.end());
    without.triangles.push_back({first, first + 1, first + 2});
  };
  std::vector<Corners> pieces;
  for (const TriangleCorners& triangle : mesh.triangles) {
    const Corners whole = {mesh.vertices_mm[triangle[0]], mesh.vertices_mm[triangle[1]], mesh.vertices_mm[triangle[2]]};
    Eigen::AlignedBox3d bounds_mm;
    for (const Vector3d& corner : whole) bounds_mm.extend(corner);
    if (!box_mm.intersects(bounds_mm)) continue;
    pieces.push_back(whole);
    while (!pieces.empty()) {
      if (looks++ % kPiecesPerQuestion == 0 && keep_going && !keep_going())
        return absl::CancelledError("mouth of a path: the caller went away");
      const Corners corners = pieces.back();
      pieces.pop_back();
      const std::size_t at = BeforeLongest(corners);
      const Vector3d &from = corners[at], &to = corners[(at + 1) % 3], &top = corners[(at + 2) % 3];
      Eigen::AlignedBox3d piece_box_mm(from);
      piece_box_mm.extend(to).extend(top);
      const Vector3d middle = (from + to + top) / 3;
      const double radius_mm = std::max({(from - middle).norm(), (to - middle).norm(), (top - middle).norm()});
      if (!mouth_box_mm.intersects(piece_box_mm) || line.DistanceMm(middle) - radius_mm > reach_mm) {
        keep(corners);
      } else if (line.Holds(corners, reach_mm)) {
        continue;
      } else if ((to - from).norm() <= piece_mm) {
        keep(corners);
      } else {
        if (++halvings > kMostMouthHalvings)
          return Refuse("mouth", "its rim takes more than " + std::to_string(kMostMouthHalvings) + " halvings",
                        "a shorter path, or a wider mouth");
        const Vector3d half = (from + to) / 2;
        pieces.push_back({half, to, top});
        pieces.push_back({from, half, top});
      }
    }
  }
  return without;
}

}  // namespace sixpoint::metrology
