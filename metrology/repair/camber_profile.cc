#include "metrology/repair/camber_profile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "metrology/frames/angles.h"
#include "metrology/linear_algebra/least_squares.h"
#include "metrology/repair/camber_extension.h"
#include "metrology/repair/outline_sides.h"
#include "metrology/statistics/ranks.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr double kSmoothReach = 0.012;  // of the line: circles within it make its parabola at a place
constexpr std::size_t kLeastNear = 6;
constexpr std::size_t kLeastCircles = 20;
constexpr double kOffLineSigmas = 5;
constexpr std::size_t kScatterOver = 12;     // circles to either side, by which scatter is known
constexpr double kLeastScatter_mm = 1e-4;    // below it circles scatter by rounding
constexpr double kLeadingReachRadii = 2;     // of the last circle: so far back the leading parabola is taken
constexpr double kTrailingReachRadii = 1.6;  // and the trailing line
constexpr double kLongestRadii = 4;          // no end is farther from its last circle

// The medial axis as functions of the way along it.
struct Line {
  std::vector<double> at_mm;
  std::vector<Vector2d> centres_mm;
  std::vector<double> radii_mm;

  double length_mm() const { return at_mm.back(); }
};

Line LineThrough(const std::vector<InscribedCircle>& circles) {
  Line line;
  for (const InscribedCircle& circle : circles) {
    const double at = line.at_mm.empty() ? 0 : line.at_mm.back() + (circle.centre_mm - line.centres_mm.back()).norm();
    line.at_mm.push_back(at);
    line.centres_mm.push_back(circle.centre_mm);
    line.radii_mm.push_back(circle.radius_mm);
  }
  return line;
}

// Of the weighted parabola through the circles about a place, less one of them where that is asked.
CamberStation Smoothed(const Line& line, double at_mm, std::size_t left_out) {
  const std::size_t count = line.at_mm.size();
  const auto lower = std::lower_bound(line.at_mm.begin(), line.at_mm.end(), at_mm - kSmoothReach * line.length_mm());
  const auto upper = std::upper_bound(lower, line.at_mm.end(), at_mm + kSmoothReach * line.length_mm());
  auto first = static_cast<std::size_t>(lower - line.at_mm.begin());
  auto end = static_cast<std::size_t>(upper - line.at_mm.begin());
  while (end - first < kLeastNear && end - first < count) {
    const bool back = end == count || (first > 0 && at_mm - line.at_mm[first - 1] < line.at_mm[end] - at_mm);
    back ? --first : ++end;
  }
  const double reach = 1.001 * std::max({line.at_mm[end - 1] - at_mm, at_mm - line.at_mm[first], 1e-9});
  Eigen::Matrix3d normal = 1e-14 * Eigen::Matrix3d::Identity();
  Eigen::Matrix3d right = Eigen::Matrix3d::Zero();
  const Vector2d origin = line.centres_mm[first];
  for (std::size_t i = first; i < end; ++i) {
    if (i == left_out) continue;
    const double x = (line.at_mm[i] - at_mm) / reach, weight = std::pow(1 - x * x, 2);
    const Eigen::Vector3d row(1, x, x * x);
    const Vector2d off = line.centres_mm[i] - origin;
    normal += weight * row * row.transpose();
    right += weight * row * Eigen::RowVector3d(off.x(), off.y(), line.radii_mm[i]);
  }
  const Eigen::Matrix3d curve = normal.ldlt().solve(right);
  CamberStation station;
  station.centre_mm = origin + Vector2d(curve(0, 0), curve(0, 1));
  station.along = Vector2d(curve(1, 0), curve(1, 1)).normalized();
  station.radius_mm = std::max(0.0, curve(0, 2));
  return station;
}

// From the middle to either end each centre farther on than the one before, as the line goes over the last half radius: about the centre of a
// round end circles lie in no order, and a line through them would turn back.
std::vector<InscribedCircle> Advancing(const std::vector<InscribedCircle>& circles, CamberFilters* filters) {
  constexpr double kLeastStep = 0.01;  // radii
  std::vector<InscribedCircle> kept;
  const std::size_t middle = circles.size() / 2;
  const auto walk = [&](bool front) {
    std::vector<InscribedCircle> way = {circles[middle]};
    for (std::size_t k = 1; front ? k <= middle : middle + k < circles.size(); ++k) {
      const InscribedCircle& next = circles[front ? middle - k : middle + k];
      std::size_t back = way.size() - 1;
      while (back > 0 && (way.back().centre_mm - way[back].centre_mm).norm() < next.radius_mm / 2) --back;
      const Vector2d step = next.centre_mm - way.back().centre_mm, along = way.back().centre_mm - way[back].centre_mm;
      if (way.size() > 1 && step.dot(along.normalized()) < kLeastStep * next.radius_mm)
        ++filters->not_ahead_count;
      else
        way.push_back(next);
    }
    return way;
  };
  const auto front = walk(true), behind = walk(false);
  kept.assign(front.rbegin(), front.rend());
  kept.insert(kept.end(), behind.begin() + 1, behind.end());
  return kept;
}

// The named filters, in their order.
std::vector<InscribedCircle> Filtered(const std::vector<InscribedCircle>& found, CamberFilters* filters) {
  std::vector<InscribedCircle> kept;
  double furthest_mm = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Vector2d along = found[std::min(i + 2, found.size() - 1)].centre_mm - found[i < 2 ? 0 : i - 2].centre_mm;
    if (Cross(along, found[i].normal) * Cross(along, found[i].other_normal) >= 0) {
      ++filters->one_sided_count;
    } else if (found[i].along_mm <= furthest_mm) {
      ++filters->out_of_order_count;
    } else {
      furthest_mm = found[i].along_mm;
      kept.push_back(found[i]);
    }
  }
  if (kept.size() < kLeastCircles) return kept;
  kept = Advancing(kept, filters);
  const Line line = LineThrough(kept);
  std::vector<double> off;
  for (std::size_t i = 0; i < kept.size(); ++i)
    off.push_back((Smoothed(line, line.at_mm[i], i).centre_mm - line.centres_mm[i]).norm());
  std::vector<InscribedCircle> near;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    // Beside its neighbours' scatter: near the ends the line bends more, and circles scatter more, than in the middle.
    const auto first = off.begin() + static_cast<std::ptrdiff_t>(i - std::min(i, kScatterOver));
    const auto end = off.begin() + static_cast<std::ptrdiff_t>(std::min(i + kScatterOver + 1, off.size()));
    const double limit_mm = kOffLineSigmas * std::max(kLeastScatter_mm, RobustSigmaOfMagnitudes({first, end}));
    if (off[i] <= limit_mm)
      near.push_back(kept[i]);
    else
      ++filters->off_line_count;
  }
  return near;
}

// Beyond the last circle: a line at the trailing edge, a parabola at the leading one, fitted to the line's last part.
Way PublishedWay(const Line& line, bool leading) {
  const double end_mm = leading ? 0 : line.length_mm();
  const CamberStation last = Smoothed(line, end_mm, line.at_mm.size());
  const double reach_mm =
      std::max((leading ? kLeadingReachRadii : kTrailingReachRadii) * last.radius_mm, kSmoothReach * line.length_mm());
  const Vector2d outward = leading ? Vector2d(-last.along) : last.along;
  std::vector<std::size_t> near;
  for (std::size_t k = 0; k < line.at_mm.size(); ++k) {
    const std::size_t i = leading ? k : line.at_mm.size() - 1 - k;
    if (std::abs(line.at_mm[i] - end_mm) <= reach_mm || near.size() < kLeastNear) near.push_back(i);
  }
  const Eigen::Index degree = leading ? 2 : 1, count = static_cast<Eigen::Index>(near.size());
  Eigen::MatrixXd rows(count, degree + 1);
  Eigen::VectorXd right(count);
  for (Eigen::Index row = 0; row < count; ++row) {
    const Vector2d off = line.centres_mm[near[static_cast<std::size_t>(row)]] - last.centre_mm;
    const double x = off.dot(outward), weight = std::max(0.05, 1 + x / reach_mm);
    for (Eigen::Index power = 0; power <= degree; ++power) rows(row, power) = weight * std::pow(x, power);
    right[row] = weight * Cross(outward, off);
  }
  const Eigen::VectorXd curve = LeastSquares(rows, right);
  return Way{last.centre_mm + curve[0] * LeftOf(outward), (outward + curve[1] * LeftOf(outward)).normalized(),
             leading ? curve[2] : 0};
}

// Each station moved to where it is as far from both sides, which part at the profile's tips.
void BisectStations(const Outline& outline, CamberProfile* profile) {
  const OutlineSides sides(outline, outline.At(outline.Nearest(profile->leading.tip_mm)),
                           outline.At(outline.Nearest(profile->trailing.tip_mm)));
  auto& stations = profile->stations;
  const auto bisect = [&](std::size_t k, const Vector2d& along) {
    const auto middle = sides.MiddleNear(stations[k].centre_mm, LeftOf(along), stations[k].radius_mm / 4);
    if (middle) stations[k].centre_mm = middle->centre_mm, stations[k].radius_mm = middle->radius_mm;
    return middle.has_value();
  };
  for (std::size_t k = 0; k < stations.size(); ++k) {
    if (bisect(k, stations[k].along)) continue;
    // So near to an end circles do not tell the line's direction: half a radius farther in does.
    const bool front = k < stations.size() / 2;
    std::size_t inner = k;
    while ((stations[inner].centre_mm - stations[k].centre_mm).norm() < stations[k].radius_mm / 2 &&
           inner != stations.size() / 2)
      front ? ++inner : --inner;
    const Vector2d outward = (stations[k].centre_mm - stations[inner].centre_mm).normalized();
    const Vector2d along = front ? Vector2d(-outward) : outward;
    if (bisect(k, along)) stations[k].along = along;
  }
}

absl::Status NoAirfoil(const std::string& what) {
  return Refuse("outline", what, "a closed airfoil: two sides between a leading and a trailing end");
}

// In the order of the outline.
std::vector<std::size_t> FarthestPair(const Outline& outline) {
  const auto& nodes = outline.nodes();
  std::vector<std::size_t> pair = {0, 0};
  double farthest = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (std::size_t k = i + 1; k < nodes.size(); ++k) {
      const double squared = (nodes[i].point_mm - nodes[k].point_mm).squaredNorm();
      if (squared > farthest) farthest = squared, pair = {i, k};
    }
  return pair;
}

}  // namespace

std::vector<double> ChebyshevPlaces(std::size_t count) {
  std::vector<double> places(count);
  for (std::size_t k = 0; k < count; ++k)
    places[k] = (1 - std::cos(kPi * static_cast<double>(k) / static_cast<double>(count - 1))) / 2;
  return places;
}

Outline ChebyshevOutline(const Outline& outline) {
  const auto& nodes = outline.nodes();
  std::vector<std::size_t> breaks;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i].before != Join::kSmooth) breaks.push_back(i);
  if (breaks.empty()) breaks = FarthestPair(outline);
  std::vector<OutlineNode> made;
  for (std::size_t b = 0; b < breaks.size(); ++b) {
    // A piece ends where the next one begins; behind a corner or a gap that is another node.
    const OutlineNode& from = nodes[breaks[b]];
    const std::size_t next = breaks[(b + 1) % breaks.size()];
    const bool smooth = nodes[next].before == Join::kSmooth;
    double length_mm = nodes[smooth ? next : outline.Previous(next)].at_mm - from.at_mm;
    if (length_mm < 0) length_mm += outline.length_mm();
    const double share = length_mm / outline.length_mm();
    const auto count = std::max<std::size_t>(4, std::lround(kOutlinePoints * share)) + (smooth ? 1 : 0);
    const std::vector<double> places = ChebyshevPlaces(count);
    for (std::size_t k = 0; k < count - (smooth ? 1 : 0); ++k) {
      // Just within its piece: at its very end a place would be the next piece's.
      const double within = std::clamp(places[k], 1e-9, 1 - 1e-9);
      const OutlinePlace place = outline.PlaceAt(from.at_mm + within * length_mm);
      OutlineNode node;
      node.point_mm = outline.PointAt(place);
      node.normal = outline.NormalAt(place);
      node.lean = (1 - place.part) * nodes[place.node].lean + place.part * nodes[outline.Next(place.node)].lean;
      if (k == 0) node.before = from.before;
      made.push_back(node);
    }
  }
  return Outline(std::move(made));
}

absl::StatusOr<CamberProfile> ProfileOf(const Outline& outline, const LeadingHint& hint, CamberMethod method) {
  if (outline.size() < kLeastCircles) return NoAirfoil(std::to_string(outline.size()) + " nodes");
  const auto camber = CamberOf(outline, hint);
  if (!camber) return NoAirfoil("no circle touches two sides");
  if (!camber->leading.place) return NoAirfoil("the leading end was not seen");
  if (!camber->trailing.place) return NoAirfoil("the trailing end was not seen");
  CamberProfile profile;
  const auto circles = Filtered(camber->circles, &profile.filters);
  if (circles.size() < kLeastCircles) return NoAirfoil(std::to_string(circles.size()) + " circles touch two sides");
  const Line line = LineThrough(circles);
  profile.length_mm = line.length_mm();
  for (const double place : ChebyshevPlaces(kCamberStations))
    profile.stations.push_back(Smoothed(line, place * line.length_mm(), line.at_mm.size()));
  const double lead_radius_mm = profile.stations.front().radius_mm, trail_radius_mm = profile.stations.back().radius_mm;
  auto leading = ExtensionAlong(PublishedWay(line, true), outline, kLongestRadii * lead_radius_mm, camber->leading);
  auto trailing = ExtensionAlong(PublishedWay(line, false), outline, kLongestRadii * trail_radius_mm, camber->trailing);
  profile.leading = std::move(leading);
  profile.trailing = std::move(trailing);
  if (method == CamberMethod::kBisected) {
    BisectStations(outline, &profile);
    const auto inside = [&](double radius_mm, bool at_front) {
      const double part = std::min(0.1, radius_mm / 2 / profile.length_mm);
      return StationAt(profile, at_front ? part : 1 - part).centre_mm;
    };
    const double leading_at_mm = outline.At(outline.Nearest(profile.leading.tip_mm));
    const double trailing_at_mm = outline.At(outline.Nearest(profile.trailing.tip_mm));
    profile.leading = BisectedExtension(std::move(profile.leading), outline, trailing_at_mm,
                                        inside(lead_radius_mm, true), lead_radius_mm);
    profile.trailing = BisectedExtension(std::move(profile.trailing), outline, leading_at_mm,
                                         inside(trail_radius_mm, false), trail_radius_mm);
    // The sides part elsewhere now: near the ends the line's middle is another.
    BisectStations(outline, &profile);
  }
  return profile;
}

CamberStation StationAt(const CamberProfile& profile, double part) {
  part = std::clamp(part, 0.0, 1.0);
  const auto last = static_cast<double>(profile.stations.size() - 1);
  const auto place = [&](std::size_t k) { return (1 - std::cos(kPi * static_cast<double>(k) / last)) / 2; };
  auto first = static_cast<std::size_t>(std::acos(std::clamp(1 - 2 * part, -1.0, 1.0)) / kPi * last);
  first = std::min(first, profile.stations.size() - 2);
  const CamberStation &one = profile.stations[first], &next = profile.stations[first + 1];
  const double span = place(first + 1) - place(first), t = std::clamp((part - place(first)) / span, 0.0, 1.0),
               u = 1 - t;
  const double chord = (next.centre_mm - one.centre_mm).norm();
  CamberStation station;
  station.centre_mm = u * u * (1 + 2 * t) * one.centre_mm + t * t * (3 - 2 * t) * next.centre_mm +
                      chord * (t * u * u * one.along - t * t * u * next.along);
  station.along = (u * one.along + t * next.along).normalized();
  station.radius_mm = u * one.radius_mm + t * next.radius_mm;
  return station;
}

}  // namespace sixpoint::metrology
