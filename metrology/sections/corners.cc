#include "metrology/sections/corners.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "metrology/frames/angles.h"
#include "metrology/sections/circle_fit.h"
#include "metrology/sections/outline.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr double kJump = 35 * kRadPerDeg, kSureJump = 25 * kRadPerDeg;  // the latter with four standard deviations less
constexpr double kCandidateTurn = 20 * kRadPerDeg;                      // of the chain about a place that is looked at
constexpr double kDirectionSigma = 0.08;                                // wanted of one side, rad
constexpr double kReach = 4, kGreatestReach = 16;                       // spacings
constexpr std::size_t kExactPoints = 6, kLeastSidePoints = 6;

struct Place {
  double at_mm = 0, reach_mm = 0, score_mm2 = 0;
  bool corner = false;
  Vector2d corner_mm = Vector2d::Zero();
};

class Finder {
 public:
  Finder(const PointChain& chain, const std::vector<FitPoint>& points, const LocalFit& fit, const CornerSearch& search)
      : chain_(chain), points_(points), fit_(fit), search_(search) {
    for (std::size_t i = 0; i < chain.points_mm.size(); ++i)
      if (chain.gap_before[i]) gaps_mm_.emplace_back(chain.at_mm[Around(i, -1)], chain.at_mm[i]);
  }

  std::vector<OutlineCorner> Run() const {
    std::vector<Place> found;
    for (std::size_t i = 0; i < chain_.points_mm.size(); ++i) {
      if (!Turns(i)) continue;
      const auto place = Judged(chain_.at_mm[i], chain_.length_mm);
      if (place && place->corner) found.push_back(*place);
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const Place& a, const Place& b) { return a.score_mm2 < b.score_mm2; });
    std::vector<Place> kept;
    for (const Place& place : found)
      if (NearestOf(kept, place.at_mm) > 0.6 * place.reach_mm) kept.push_back(place);
    std::vector<OutlineCorner> corners;
    const auto taken = [&](double at_mm) {
      return std::any_of(corners.begin(), corners.end(),
                         [&](const OutlineCorner& corner) { return Apart(corner.at_mm, at_mm) <= search_.clear_mm; });
    };
    for (const Place& place : kept) {
      // Once more about the corner itself, and no farther than the next one.
      std::vector<Place> others;
      for (const Place& other : kept)
        if (other.at_mm != place.at_mm) others.push_back(other);
      const double limit = NearestOf(others, place.at_mm) - search_.clear_mm;
      const auto again = Judged(AtOf(place), limit);
      if (again && !again->corner) continue;
      const Place& best = again ? *again : place;
      double at = AtOf(best);
      at -= chain_.length_mm * std::floor(at / chain_.length_mm);
      // Two places may have found the same corner: the better one came first.
      if (!taken(at)) corners.push_back({at, best.corner_mm});
    }
    std::sort(corners.begin(), corners.end(),
              [](const OutlineCorner& a, const OutlineCorner& b) { return a.at_mm < b.at_mm; });
    return corners;
  }

 private:
  double Apart(double a, double b) const { return std::abs(std::remainder(a - b, chain_.length_mm)); }

  double NearestOf(const std::vector<Place>& places, double at_mm) const {
    double nearest = chain_.length_mm;
    for (const Place& place : places) nearest = std::min(nearest, Apart(place.at_mm, at_mm));
    return nearest;
  }

  std::size_t Around(std::size_t i, std::ptrdiff_t by) const {
    const auto n = static_cast<std::ptrdiff_t>(chain_.points_mm.size());
    return static_cast<std::size_t>((static_cast<std::ptrdiff_t>(i) + by % n + n) % n);
  }

  // Whether the chain turns about the point at all.
  bool Turns(std::size_t i) const {
    for (const std::ptrdiff_t reach : {3, 6}) {
      const Vector2d into = chain_.points_mm[i] - chain_.points_mm[Around(i, -reach)];
      const Vector2d out = chain_.points_mm[Around(i, reach)] - chain_.points_mm[i];
      if (into.dot(out) < std::cos(kCandidateTurn) * into.norm() * out.norm()) return true;
    }
    return false;
  }

  // Along the chain to the next gap that way.
  double ToGap(double at_mm, bool ahead) const {
    double least = chain_.length_mm;
    for (const auto& [begin_mm, end_mm] : gaps_mm_) {
      double off = ahead ? begin_mm - at_mm : at_mm - end_mm;
      off -= chain_.length_mm * std::floor(off / chain_.length_mm);
      least = std::min(least, off);
    }
    return least;
  }

  // As far as a side goes that tells its direction; of exact points the next few.
  std::optional<double> SideReach(double at_mm, double limit_mm, bool ahead) const {
    limit_mm = std::min(limit_mm, ToGap(at_mm, ahead));
    const auto end = [&](double reach_mm) {
      return ahead ? fit_.WindowOf({at_mm, -search_.clear_mm, reach_mm, 2})
                   : fit_.WindowOf({at_mm, reach_mm, -search_.clear_mm, 2});
    };
    double reach = kReach * chain_.spacing_mm;
    const double greatest = std::min(limit_mm, (search_.exact ? 4 : 1) * kGreatestReach * chain_.spacing_mm);
    for (; reach < greatest; reach *= search_.exact ? 1.1 : 1.25) {
      const auto count = static_cast<double>(end(reach).count);
      const double variance = 192 * std::pow(search_.noise_mm / reach, 2) / std::max(1.0, count);
      if (search_.exact ? count >= kExactPoints : count >= kLeastSidePoints && variance < std::pow(kDirectionSigma, 2))
        break;
    }
    reach = std::min(reach, greatest);
    constexpr std::size_t kFewest = 5;  // where another corner or a gap is near
    if (reach <= search_.clear_mm || end(reach).count < kFewest) return std::nullopt;
    return reach;
  }

  double DirectionVariance(const LocalCurve& curve) const {
    double variance = 0;
    for (std::size_t k = 0; k < curve.by_slope.size(); ++k)
      variance += std::pow(static_cast<double>(curve.by_slope[k]) * search_.noise_mm, 2) /
                  points_[(curve.first + k) % points_.size()].count;
    return variance;
  }

  // Whether a circle follows the points of both sides about as well: then it is a small round end.
  bool RoundAsWell(const LocalCurve& one, const LocalCurve& other, const Place& place) const {
    std::vector<Vector2d> both;
    for (const LocalCurve* side : {&one, &other})
      for (std::size_t k = 0; k < side->by_offset.size(); ++k)
        both.push_back(points_[(side->first + k) % points_.size()].point_mm);
    constexpr double kMiss = 0.01;  // of the reach: a circle misses a corner of 35 deg by more
    const double allowed = 3 * std::max(place.score_mm2, std::pow(search_.noise_mm, 2));
    const double missed = FitCircle(both).mean_square_mm2;
    return std::isfinite(missed) && missed < allowed + std::pow(kMiss * place.reach_mm, 2);
  }

  // Absent: too few points to either side.
  std::optional<Place> Judged(double at_mm, double limit_mm) const {
    at_mm -= chain_.length_mm * std::floor(at_mm / chain_.length_mm);
    const auto after = std::upper_bound(chain_.at_mm.begin(), chain_.at_mm.end(), at_mm);
    const auto i = static_cast<std::size_t>(after - chain_.at_mm.begin()) - 1;
    const Vector2d step = chain_.points_mm[Around(i, 1)] - chain_.points_mm[i];
    const Vector2d start = chain_.points_mm[i] + (at_mm - chain_.at_mm[i]) / step.norm() * step;
    const auto behind = SideReach(at_mm, limit_mm, false), ahead = SideReach(at_mm, limit_mm, true);
    if (!behind || !ahead) return std::nullopt;
    const Vector2d into = start - chain_.points_mm[Around(i, -3)], out = chain_.points_mm[Around(i, 4)] - start;
    const auto one = fit_.At({at_mm, *behind, -search_.clear_mm, 2}, start, into);
    const auto other = fit_.At({at_mm, -search_.clear_mm, *ahead, 2}, start, out);
    if (!one || !other) return std::nullopt;
    const double jump = std::acos(std::clamp(one->normal.dot(other->normal), -1.0, 1.0));
    const double sigma = std::sqrt(DirectionVariance(*one) + DirectionVariance(*other));
    Place place;
    place.at_mm = at_mm;
    place.reach_mm = std::min(*behind, *ahead);
    if (jump < kJump || jump - 4 * sigma < kSureJump) return place;
    const double freedom = std::max(1.0, one->freedom + other->freedom);
    place.score_mm2 = (one->sample_variance_mm2 * one->freedom + other->sample_variance_mm2 * other->freedom) / freedom;
    constexpr double kMiss = 0.03;  // of the reach: what a corner that is a little broken still misses its sides by
    if (place.score_mm2 > std::pow(3 * search_.noise_mm, 2) + std::pow(kMiss * place.reach_mm, 2)) return place;
    if (RoundAsWell(*one, *other, place)) return place;
    Eigen::Matrix2d normals;
    normals << one->normal.transpose(), other->normal.transpose();
    if (std::abs(normals.determinant()) < 0.2) return place;
    place.corner_mm = normals.inverse() * Vector2d(one->normal.dot(one->point_mm), other->normal.dot(other->point_mm));
    place.corner = (place.corner_mm - start).norm() <= std::max(3 * chain_.spacing_mm, place.reach_mm);
    return place;
  }

  // Where along the chain the corner is.
  double AtOf(const Place& place) const {
    double best = INFINITY, at = place.at_mm;
    for (std::size_t i = 0; i < chain_.points_mm.size(); ++i) {
      if (Apart(chain_.at_mm[i], place.at_mm) > 6 * chain_.spacing_mm + place.reach_mm) continue;
      const Vector2d step = chain_.points_mm[Around(i, 1)] - chain_.points_mm[i];
      const double part = std::clamp((place.corner_mm - chain_.points_mm[i]).dot(step) / step.squaredNorm(), 0.0, 1.0);
      const double off = (chain_.points_mm[i] + part * step - place.corner_mm).norm();
      if (off < best) best = off, at = chain_.at_mm[i] + part * step.norm();
    }
    return at;
  }

  const PointChain& chain_;
  const std::vector<FitPoint>& points_;
  const LocalFit& fit_;
  const CornerSearch& search_;
  std::vector<std::pair<double, double>> gaps_mm_;
};

}  // namespace

std::vector<OutlineCorner> CornersOf(const PointChain& chain, const std::vector<FitPoint>& points, const LocalFit& fit,
                                     const CornerSearch& search) {
  return Finder(chain, points, fit, search).Run();
}

}  // namespace sixpoint::metrology
