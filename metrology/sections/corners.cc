#include "metrology/sections/corners.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "metrology/sections/outline.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr double kRad = 3.14159265358979323846 / 180;
constexpr double kChainJump = 35 * kRad, kJump = 30 * kRad;
constexpr double kLeastMiss = 0.015;  // of the window's half width, root mean square
constexpr int kSegments = 6;

// Of the chain's segments after point i, on that side, continued to the point: least squares of a line.
std::optional<double> DirectionAt(const PointChain& chain, std::size_t i, bool after) {
  const std::size_t n = chain.points_mm.size();
  double sum_s = 0, sum_a = 0, sum_ss = 0, sum_sa = 0, walked = 0, last = 0;
  int count = 0;
  std::size_t at = i;
  for (; count < kSegments; ++count) {
    const std::size_t next = after ? (at + 1) % n : (at + n - 1) % n;
    if (chain.gap_before[after ? next : at]) break;
    const Vector2d step = after ? Vector2d(chain.points_mm[next] - chain.points_mm[at])
                                : Vector2d(chain.points_mm[at] - chain.points_mm[next]);
    double angle = std::atan2(step.y(), step.x());
    if (count > 0) angle = last + std::remainder(angle - last, 360 * kRad);
    last = angle;
    const double s = walked + step.norm() / 2;
    walked += step.norm();
    sum_s += s, sum_a += angle, sum_ss += s * s, sum_sa += s * angle;
    at = next;
  }
  if (count < 3) return std::nullopt;
  const double across = count * sum_ss - sum_s * sum_s;
  return (sum_ss * sum_a - sum_s * sum_sa) / across;
}

struct Candidate {
  std::size_t point;
  double jump;
};

// The greatest jump of each neighbourhood.
std::vector<Candidate> Candidates(const PointChain& chain) {
  std::vector<Candidate> found;
  for (std::size_t i = 0; i < chain.points_mm.size(); ++i) {
    const auto before = DirectionAt(chain, i, false), after = DirectionAt(chain, i, true);
    if (!before || !after) continue;
    const double jump = std::abs(std::remainder(*after - *before, 360 * kRad));
    if (jump < kChainJump) continue;
    const bool same = !found.empty() && chain.at_mm[i] - chain.at_mm[found.back().point] < 2.5 * chain.spacing_mm;
    if (!same)
      found.push_back({i, jump});
    else if (jump > found.back().jump)
      found.back() = {i, jump};
  }
  return found;
}

}  // namespace

std::vector<OutlineCorner> CornersOf(const PointChain& chain, const LocalFit& fit, double clear_mm, double reach_mm) {
  const std::vector<Candidate> candidates = Candidates(chain);
  const std::size_t n = chain.points_mm.size();
  std::vector<OutlineCorner> corners;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const std::size_t i = candidates[k].point;
    const double at = chain.at_mm[i], reach = reach_mm;
    const auto to_next = [&](std::size_t other, bool forward) {
      if (candidates.size() < 2) return reach;
      double off = chain.at_mm[candidates[other].point] - at;
      if (!forward) off = -off;
      if (off <= 0) off += chain.length_mm;
      return std::min(reach, off - clear_mm);
    };
    const double ahead = to_next((k + 1) % candidates.size(), true);
    const double behind = to_next((k + candidates.size() - 1) % candidates.size(), false);
    const Vector2d into = chain.points_mm[i] - chain.points_mm[(i + n - 1) % n];
    const Vector2d out = chain.points_mm[(i + 1) % n] - chain.points_mm[i];
    const auto one = fit.At({at, behind, -clear_mm, 2}, chain.points_mm[i], into);
    const auto other = fit.At({at, -clear_mm, ahead, 2}, chain.points_mm[i], out);
    if (!one || !other) continue;
    const double cosine = one->normal.dot(other->normal);
    if (cosine > std::cos(kJump)) continue;
    // A smooth curve through both sides must miss them by much more than they scatter: a small round end it follows.
    const double half = std::min(ahead, behind);
    const auto smooth = fit.At({at, half, half, 4}, chain.points_mm[i], into.normalized() + out.normalized());
    const double scatter = std::max(one->sample_variance_mm2, other->sample_variance_mm2);
    if (!smooth || smooth->sample_variance_mm2 - scatter < std::pow(kLeastMiss * half, 2)) continue;
    Eigen::Matrix2d normals;
    normals << one->normal.transpose(), other->normal.transpose();
    if (std::abs(normals.determinant()) < 0.3) continue;
    OutlineCorner corner;
    corner.point_mm = normals.inverse() * Vector2d(one->normal.dot(one->point_mm), other->normal.dot(other->point_mm));
    if ((corner.point_mm - chain.points_mm[i]).norm() > 3 * chain.spacing_mm) continue;
    // Where along the chain that is: from the point on, by its own direction there.
    const Vector2d off = corner.point_mm - chain.points_mm[i];
    const Vector2d along = off.dot(out) > 0 ? out : into;
    corner.at_mm = at + off.dot(along.normalized());
    corners.push_back(corner);
  }
  for (OutlineCorner& corner : corners) corner.at_mm -= chain.length_mm * std::floor(corner.at_mm / chain.length_mm);
  std::sort(corners.begin(), corners.end(),
            [](const OutlineCorner& a, const OutlineCorner& b) { return a.at_mm < b.at_mm; });
  return corners;
}

}  // namespace sixpoint::metrology
