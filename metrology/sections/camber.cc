#include "metrology/sections/camber.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr double kTouchCosine = 0.5;      // contacts with normals less than 60 deg apart are one
constexpr double kCamberCosine = -0.342;  // 110 deg: nearer to a tip circles touch the end itself
constexpr double kNearTipCosine =
    -0.17;  // 100 deg: so far circles are looked at, to know where 110 deg is between two of them
constexpr double kGreatCosine = -0.5;
constexpr double kStraightReach = 1.6;  // radii of a round end: from so far its camber line's direction is taken
constexpr double kBendReach = 0.035;    // of the outline

struct Touching {
  InscribedCircle circle;
  bool sound = false;
};

// The circle through p with its centre inward that also passes through q: its radius.
double RadiusThrough(const Vector2d& p, const Vector2d& normal, const Vector2d& q) {
  const double depth = normal.dot(p - q);
  return depth > 0 ? (q - p).squaredNorm() / (2 * depth) : std::numeric_limits<double>::infinity();
}

// Whether the unseen, at the least its chord, cuts the circle.
bool CutByGap(const Outline& outline, const InscribedCircle& circle) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    if (outline.JoinAfter(i) != Join::kGap) continue;
    const Vector2d& a = outline.nodes()[i].point_mm;
    const Vector2d along = outline.nodes()[outline.Next(i)].point_mm - a;
    const double part = std::clamp((circle.centre_mm - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
    if ((circle.centre_mm - a - part * along).norm() < 0.999 * circle.radius_mm) return true;
  }
  return false;
}

// The greatest circle inside that touches at the node: the smallest of those through it and another place.
Touching CircleAt(const Outline& outline, std::size_t i) {
  const auto& nodes = outline.nodes();
  const Vector2d &p = nodes[i].point_mm, &normal = nodes[i].normal;
  double least = std::numeric_limits<double>::infinity();
  std::size_t best = i;
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    if (nodes[j].normal.dot(normal) > kTouchCosine) continue;
    const double radius = RadiusThrough(p, normal, nodes[j].point_mm);
    if (radius < least) least = radius, best = j;
  }
  Touching touching;
  if (best == i) return touching;
  OutlinePlace place{best, 0};
  const auto radius_at = [&](const OutlinePlace& at) { return RadiusThrough(p, normal, outline.PointAt(at)); };
  for (const std::size_t from : {outline.Previous(best), best}) {
    if (outline.JoinAfter(from) != Join::kSmooth) continue;
    // Where it touches, the way from there to the centre is the normal; beyond the place it leans back.
    const auto slope = [&](double part) {
      const OutlinePlace at{from, part};
      const Vector2d q = outline.PointAt(at), along = LeftOf(outline.NormalAt(at));
      return (q - p).dot(along) * 2 * normal.dot(p - q) + (q - p).squaredNorm() * normal.dot(along);
    };
    double low = 0, high = 1, at_low = slope(0), at_high = slope(1);
    if (!(at_low < 0 && at_high > 0)) continue;
    double part = 0.5;
    for (int k = 0; k < 30 && high - low > 1e-9; ++k) {  // by turns a secant and a half
      part = k % 3 == 2 ? (low + high) / 2 : low + (high - low) * at_low / (at_low - at_high);
      const double value = slope(part);
      if (value < 0)
        low = part, at_low = value;
      else
        high = part, at_high = value;
      if (std::abs(value) < 1e-13 * (1 + least)) break;
    }
    if (radius_at({from, part}) <= least) least = radius_at({from, part}), place = {from, part};
  }
  InscribedCircle& circle = touching.circle;
  circle.radius_mm = least;
  circle.centre_mm = p - least * normal;
  circle.at_mm = nodes[i].at_mm;
  circle.other_at_mm = outline.At(place);
  circle.normal = normal;
  circle.other_normal = (outline.PointAt(place) - circle.centre_mm).normalized();
  touching.sound = std::isfinite(least) && !CutByGap(outline, circle);
  return touching;
}

// One of the two ways around the outline from the greatest circle's contacts: circles with both contacts on it, nearest to the end last.
struct Side {
  double from_mm = 0, length_mm = 0, around_mm = 0;
  double corner_low = std::numeric_limits<double>::infinity(),
         corner_high = -1;  // first and last corner, from `from_mm` on
  int corner_count = 0;
  std::vector<InscribedCircle> circles;

  double Along(double at_mm) const {
    const double along = at_mm - from_mm;
    return along - around_mm * std::floor(along / around_mm);
  }
};

Side SideOf(const Outline& outline, const std::vector<Touching>& touching, double from_mm, double to_mm) {
  Side side;
  side.from_mm = from_mm;
  side.around_mm = outline.length_mm();
  side.length_mm = side.Along(to_mm);
  for (const OutlineNode& node : outline.nodes()) {
    const double along = side.Along(node.at_mm);
    if (node.before != Join::kCorner || along > side.length_mm) continue;
    side.corner_low = std::min(side.corner_low, along);
    side.corner_high = std::max(side.corner_high, along);
    ++side.corner_count;
  }
  std::vector<std::pair<double, const InscribedCircle*>> ordered;
  constexpr double kNear = 1e-6;
  for (const Touching& one : touching) {
    if (!one.sound || one.circle.normal.dot(one.circle.other_normal) > kNearTipCosine) continue;
    const double a = side.Along(one.circle.at_mm), b = side.Along(one.circle.other_at_mm);
    if (a > side.length_mm + kNear || b > side.length_mm + kNear) continue;
    if (side.corner_count > 0) {
      const double low = std::min(a, b), high = std::max(a, b);
      if (!(low < side.corner_low - kNear && high > side.corner_high + kNear)) continue;
    }
    ordered.emplace_back(std::abs(a - b), &one.circle);
  }
  std::stable_sort(ordered.begin(), ordered.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  for (const auto& [between_mm, circle] : ordered) {
    side.circles.push_back(*circle);
    side.circles.back().along_mm = between_mm / 2;
  }
  return side;
}

// The camber line's last part as a parabola over its own direction.
struct EndCurve {
  Vector2d origin_mm, along;
  double scale_mm = 1, end = 0;  // end: the last circle's place, in scales
  Eigen::Vector3d curve = Eigen::Vector3d::Zero();

  double Over(const Vector2d& point) const { return (point - origin_mm).dot(along) / scale_mm; }
  void TakeAt(double x, SectionEnd* taken) const {
    taken->last_mm = origin_mm + x * scale_mm * along + (curve[0] + x * (curve[1] + x * curve[2])) * LeftOf(along);
    taken->outward = (along + (curve[1] + 2 * curve[2] * x) / scale_mm * LeftOf(along)).normalized();
  }
};

double Opening(const InscribedCircle& circle) { return circle.normal.dot(circle.other_normal); }

// Nearest to the end first: where the contacts' normals are 110 deg apart, between two circles. What is nearer to the tip goes.
InscribedCircle LastCircle(std::vector<InscribedCircle>* from_end) {
  const auto last = std::find_if(from_end->begin(), from_end->end() - 1,
                                 [](const InscribedCircle& circle) { return Opening(circle) <= kCamberCosine; });
  InscribedCircle found = *last;
  if (last != from_end->begin()) {
    const InscribedCircle& beyond = *(last - 1);
    const double part = (kCamberCosine - Opening(*last)) / (Opening(beyond) - Opening(*last));
    found.centre_mm += part * (beyond.centre_mm - found.centre_mm);
    found.radius_mm += part * (beyond.radius_mm - found.radius_mm);
  }
  from_end->erase(from_end->begin(), last);
  return found;
}

// Circles count the less the nearer they are to where they would not count: so that none comes in or goes out at once.
EndCurve FitEnd(const std::vector<InscribedCircle>& from_end, const InscribedCircle& last, double reach_mm) {
  constexpr double kTaper = 0.15;  // of the opening's cosine
  std::vector<Vector2d> centres;
  std::vector<double> shares;
  for (const InscribedCircle& circle : from_end) {
    const double part = (circle.centre_mm - last.centre_mm).norm() / reach_mm;
    if (part > 1 && centres.size() >= 8) continue;
    centres.push_back(circle.centre_mm);
    shares.push_back(std::clamp((kCamberCosine - Opening(circle)) / kTaper, 0.02, 1.0) *
                     std::max(0.02, std::pow(1 - std::min(1.0, part * part), 2)));
  }
  EndCurve fit;
  fit.origin_mm = last.centre_mm;
  Vector2d along = Vector2d::Zero();
  for (const Vector2d& centre : centres)
    if ((last.centre_mm - centre).norm() > along.norm()) along = last.centre_mm - centre;
  fit.scale_mm = std::max(1e-6, along.norm());
  if (along.norm() < 1e-9) along = last.normal + last.other_normal;
  fit.along = along.normalized();
  std::vector<double> weights = shares;
  for (int turn = 0; turn < 3; ++turn) {
    Eigen::Matrix3d normal = 1e-12 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const auto row = [&](const Vector2d& centre) {
      const double x = fit.Over(centre);
      return Eigen::Vector3d(1, x, x * x);
    };
    for (std::size_t i = 0; i < centres.size(); ++i) {
      normal += weights[i] * row(centres[i]) * row(centres[i]).transpose();
      right += weights[i] * Cross(fit.along, centres[i] - fit.origin_mm) * row(centres[i]);
    }
    fit.curve = normal.ldlt().solve(right);
    std::vector<double> off;
    for (const Vector2d& centre : centres)
      off.push_back(std::abs(Cross(fit.along, centre - fit.origin_mm) - row(centre).dot(fit.curve)));
    const double limit = 4.685 * RobustSigmaOfMagnitudes(off);
    for (std::size_t i = 0; i < centres.size(); ++i) {
      const double ratio = limit > 1e-9 ? off[i] / limit : 0;
      weights[i] = shares[i] * (ratio < 1 ? std::pow(1 - ratio * ratio, 2) : 0);
    }
  }
  return fit;
}

// Where the ray leaves the outline within the side.
void FindTip(const Outline& outline, const Side& side, double least_ahead_mm, double last_radius_mm, SectionEnd* end) {
  end->place.reset();
  double nearest = std::numeric_limits<double>::infinity();
  bool in_gap = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const OutlineNode &one = outline.nodes()[i], &next = outline.nodes()[outline.Next(i)];
    if (side.Along(one.at_mm) > side.length_mm || next.before == Join::kCorner) continue;
    const auto across = [&](double part) { return Cross(end->outward, outline.PointAt({i, part}) - end->last_mm); };
    const double first = across(0), last = across(1);
    if ((first < 0) == (last < 0)) continue;
    double low = 0, high = 1;
    for (int k = 0; k < 45; ++k) ((across((low + high) / 2) < 0) == (first < 0) ? low : high) = (low + high) / 2;
    const double ahead = end->outward.dot(outline.PointAt({i, low}) - end->last_mm);
    if (ahead < least_ahead_mm || ahead > nearest) continue;
    nearest = ahead;
    in_gap = next.before == Join::kGap;
    end->place = OutlinePlace{i, low};
  }
  if (!end->place || in_gap) {
    end->place.reset();
    end->kind = EndKind::kNotSeen;
    return;
  }
  end->kind = side.corner_count == 0 ? EndKind::kRound : side.corner_count == 1 ? EndKind::kSharp : EndKind::kSquare;
  if (end->kind == EndKind::kSharp) {
    // A corner that the camber line does not come to is one of two, the other of which is too broken to be seen.
    const OutlinePlace corner = outline.PlaceAt(side.from_mm + side.corner_low);
    constexpr double kBeside = 0.4;  // of the last circle's radius
    if ((outline.PointAt(corner) - outline.PointAt(*end->place)).norm() < kBeside * last_radius_mm)
      end->place = corner;
    else
      end->kind = EndKind::kSquare;
  }
  end->tip_mm = outline.PointAt(*end->place);
}

SectionEnd EndOf(const Outline& outline, const Side& side, const Side& other, const InscribedCircle& greatest) {
  std::vector<InscribedCircle> from_end(side.circles.rbegin(), side.circles.rend());
  from_end.push_back(greatest);
  from_end.insert(from_end.end(), other.circles.begin(), other.circles.end());
  const InscribedCircle last = LastCircle(&from_end);
  const double radius_mm = last.radius_mm;
  SectionEnd end;
  // A round end's camber line ends in its own centre, and goes on straight. A square one's was not followed that far: it goes on as it bends.
  const bool bends = side.corner_count > 0;
  const EndCurve curve = FitEnd(
      from_end, last, bends ? std::max(4 * radius_mm, kBendReach * outline.length_mm()) : kStraightReach * radius_mm);
  curve.TakeAt(curve.end, &end);
  FindTip(outline, side, 0, radius_mm, &end);
  for (int turn = 0; turn < 4 && bends && end.place; ++turn) {
    curve.TakeAt(curve.Over(end.tip_mm), &end);
    FindTip(outline, side, -radius_mm, radius_mm, &end);
  }
  return end;
}

const Vector2d& ReachOf(const SectionEnd& end) { return end.place ? end.tip_mm : end.last_mm; }

}  // namespace

Peak PeakOf(const std::vector<Peak>& points, double reach) {
  const auto greatest =
      std::max_element(points.begin(), points.end(), [](const Peak& a, const Peak& b) { return a.y < b.y; });
  // About the place found, once more: so that it does not hang on which point is the greatest.
  Peak peak = *greatest;
  for (int turn = 0; turn < 4; ++turn) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    int count = 0;
    for (const Peak& point : points) {
      const double x = (point.x - peak.x) / reach;
      if (std::abs(x) > 1) continue;
      const double weight = std::pow(1 - x * x, 2);
      const Eigen::Vector3d row(1, x, x * x);
      normal += weight * row * row.transpose();
      right += weight * (point.y - greatest->y) * row;
      ++count;
    }
    if (count < 5) return *greatest;
    const Eigen::Vector3d curve = normal.ldlt().solve(right);
    if (!(curve[2] < 0) || std::abs(curve[1] / (2 * curve[2])) > 1) return *greatest;
    const double x = -curve[1] / (2 * curve[2]);
    peak = {peak.x + x * reach, greatest->y + curve[0] + x * curve[1] / 2};
  }
  return peak;
}

std::optional<Camber> CamberOf(const Outline& outline, const LeadingHint& hint) {
  std::vector<Touching> touching;
  for (std::size_t i = 0; i < outline.size(); ++i) touching.push_back(CircleAt(outline, i));
  const Touching* greatest = nullptr;
  for (const Touching& one : touching)
    if (one.sound && one.circle.normal.dot(one.circle.other_normal) < kGreatCosine &&
        (greatest == nullptr || one.circle.radius_mm > greatest->circle.radius_mm))
      greatest = &one;
  if (greatest == nullptr) return std::nullopt;
  Camber camber;
  camber.greatest = greatest->circle;
  const Side one = SideOf(outline, touching, camber.greatest.at_mm, camber.greatest.other_at_mm);
  const Side other = SideOf(outline, touching, camber.greatest.other_at_mm, camber.greatest.at_mm);
  SectionEnd first = EndOf(outline, one, other, camber.greatest), second = EndOf(outline, other, one, camber.greatest);
  const bool first_leads = hint.near_mm
                               ? (ReachOf(first) - *hint.near_mm).norm() <= (ReachOf(second) - *hint.near_mm).norm()
                               : ReachOf(first).x() <= ReachOf(second).x();
  const Side &leading = first_leads ? one : other, &trailing = first_leads ? other : one;
  camber.leading = first_leads ? first : second;
  camber.trailing = first_leads ? second : first;
  camber.greatest.along_mm = leading.length_mm / 2;
  camber.circles.assign(leading.circles.rbegin(), leading.circles.rend());
  camber.circles.push_back(camber.greatest);
  const auto near_tip = [](const InscribedCircle& circle) { return Opening(circle) > kCamberCosine; };
  for (InscribedCircle circle : trailing.circles) {
    circle.along_mm = outline.length_mm() / 2 - circle.along_mm;
    camber.circles.push_back(circle);
  }
  camber.circles.erase(std::remove_if(camber.circles.begin(), camber.circles.end(), near_tip), camber.circles.end());
  const Vector2d from = ReachOf(camber.leading), along = (ReachOf(camber.trailing) - from).normalized();
  for (const InscribedCircle& circle : camber.circles) {
    const double off = Cross(along, circle.centre_mm - from);
    if (std::abs(off) > std::abs(camber.bow_mm)) camber.bow_mm = off;
  }
  return camber;
}

}  // namespace sixpoint::metrology
