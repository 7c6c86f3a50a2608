#include "metrology/kinematics/two_turns.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
constexpr double kLimitSlack_rad = 1e-12;

double& Of(WhichTurn turn, TurnAngles& angles) {
  return turn == WhichTurn::kFirst ? angles.first_rad : angles.second_rad;
}
double Of(WhichTurn turn, const TurnAngles& angles) {
  return turn == WhichTurn::kFirst ? angles.first_rad : angles.second_rad;
}

Vector3d TurnedAbout(const Vector3d& axis, const Vector3d& v, double cosine, double sine) {
  const Vector3d along = axis * axis.dot(v);
  return along + (v - along) * cosine + axis.cross(v) * sine;
}

bool Within(double angle, double minimum, double maximum) {
  return angle >= minimum - kLimitSlack_rad && angle <= maximum + kLimitSlack_rad;
}

double Held(double near, double minimum, double maximum) { return std::fmin(std::fmax(near, minimum), maximum); }

// Both angles moved to whole turns within the limits.
std::optional<TurnAngles> Bounded(const TurnAngles& angles, const TurnAngles& near, const TurnLimits& limits) {
  const auto first = WithinLimits(angles.first_rad, near.first_rad, limits.first_minimum_rad, limits.first_maximum_rad);
  const auto second =
      WithinLimits(angles.second_rad, near.second_rad, limits.second_minimum_rad, limits.second_maximum_rad);
  if (!first || !second) return std::nullopt;
  return TurnAngles{*first, *second};
}

// A direction that is to be turned, and where to.
struct Task {
  const TwoTurns& turns;
  const Vector3d& from;
  const Vector3d& onto;
  const TurnAngles& near;
  const TurnLimits& limits;
  double allowed_tilt_rad;

  // With that angle of an axis as it is; none where the other is not within its limits, or the tilt not allowed.
  std::optional<TurnChoice> WithHeldAt(WhichTurn held, double held_rad) const {
    const TurnAngles best = WithHeld(turns, from, onto, held, held_rad);
    const bool of_first = held == WhichTurn::kFirst;
    if (!Within(held_rad, of_first ? limits.first_minimum_rad : limits.second_minimum_rad,
                of_first ? limits.first_maximum_rad : limits.second_maximum_rad))
      return std::nullopt;
    const auto other =
        of_first ? WithinLimits(best.second_rad, near.second_rad, limits.second_minimum_rad, limits.second_maximum_rad)
                 : WithinLimits(best.first_rad, near.first_rad, limits.first_minimum_rad, limits.first_maximum_rad);
    if (!other) return std::nullopt;
    TurnChoice choice{of_first ? TurnAngles{held_rad, *other} : TurnAngles{*other, held_rad}, 0, held};
    choice.tilt_rad = TiltOf(turns, from, onto, choice.angles);
    if (choice.tilt_rad > allowed_tilt_rad) return std::nullopt;
    return choice;
  }

  // The least swing of the narrow axis, on the way to the exact angle, that leaves no more tilt than is allowed.
  std::optional<TurnChoice> LeastSwing(WhichTurn narrow, double exact_rad) const {
    const double near_rad = Of(narrow, near);
    std::optional<TurnChoice> best = WithHeldAt(narrow, near_rad);
    if (best) return best;
    constexpr int kHalvings = 40;
    double low = 0, high = 1;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = (low + high) / 2;
      if (auto choice = WithHeldAt(narrow, near_rad + middle * (exact_rad - near_rad))) {
        best = choice;
        high = middle;
      } else {
        low = middle;
      }
    }
    return best;
  }
};

// The angle's cosine and sine about the narrow axis, both ways: a cos + b sin = d, nearest to it where none is.
struct Crossings {
  std::array<double, 2> cosine, sine;
  bool reached = true;
};
Crossings CrossingsOf(double a, double b, double d) {
  const double h2 = a * a + b * b, h = std::sqrt(h2);
  const double r2 = (h - d) * (h + d);
  if (!(r2 >= 0)) {
    const double way = d > 0 ? 1 : -1;
    return {{way * a / h, way * a / h}, {way * b / h, way * b / h}, false};
  }
  const double r = std::sqrt(r2);
  return {{(a * d + b * r) / h2, (a * d - b * r) / h2}, {(b * d - a * r) / h2, (b * d + a * r) / h2}, true};
}

}  // namespace

bool TwoTurns::Parallel() const { return first.cross(second).norm() < kSingularAngle_rad; }

double AngleAbout(const Vector3d& axis, const Vector3d& from, const Vector3d& to) {
  const Vector3d u = from - axis * axis.dot(from), v = to - axis * axis.dot(to);
  return std::atan2(axis.dot(u.cross(v)), u.dot(v));
}

std::optional<double> WithinLimits(double angle_rad, double near_rad, double minimum_rad, double maximum_rad) {
  const double turn = 2 * kPi;
  const double first = std::ceil((minimum_rad - kLimitSlack_rad - angle_rad) / turn);
  const double last = std::floor((maximum_rad + kLimitSlack_rad - angle_rad) / turn);
  if (!(first <= last)) return std::nullopt;
  const double wanted = std::round((near_rad - angle_rad) / turn);
  return angle_rad + turn * std::fmin(std::fmax(wanted, first), last);
}

Vector3d Turned(const TwoTurns& turns, const TurnAngles& angles, const Vector3d& from) {
  const Vector3d c = TurnedAbout(turns.second, from, std::cos(angles.second_rad), std::sin(angles.second_rad));
  return TurnedAbout(turns.first, c, std::cos(angles.first_rad), std::sin(angles.first_rad));
}

double TiltOf(const TwoTurns& turns, const Vector3d& from, const Vector3d& onto, const TurnAngles& angles) {
  const Vector3d turned = Turned(turns, angles, from);
  return std::atan2(turned.cross(onto).norm(), turned.dot(onto));
}

TurnAngles WithHeld(const TwoTurns& turns, const Vector3d& from, const Vector3d& onto, WhichTurn held,
                    double held_rad) {
  const double cosine = std::cos(held_rad), sine = std::sin(held_rad);
  if (held == WhichTurn::kFirst)
    return {held_rad, AngleAbout(turns.second, from, TurnedAbout(turns.first, onto, cosine, -sine))};
  return {AngleAbout(turns.first, TurnedAbout(turns.second, from, cosine, sine), onto), held_rad};
}

// c = R(second) from = R(first)^-1 onto lies on the cone about each axis. The narrow cone is cut, where rounding tells least in c; the
// other angle follows c.
TurnBranches BranchesOf(const TwoTurns& turns, const Vector3d& from, const Vector3d& onto, const TurnAngles& near) {
  const Vector3d &first = turns.first, &second = turns.second;
  const Vector3d across_second = second.cross(from), across_first = first.cross(onto);
  const double second_sine2 = across_second.squaredNorm(), first_sine2 = across_first.squaredNorm();
  TurnBranches found;
  found.narrow = second_sine2 <= first_sine2 ? WhichTurn::kSecond : WhichTurn::kFirst;
  found.narrow_sine = std::sqrt(std::fmin(second_sine2, first_sine2));
  if (found.narrow_sine <= kAlongAxis_rad) {
    found.free = found.narrow;
    found.count = 1;
    found.angles[0] = WithHeld(turns, from, onto, found.free, Of(found.free, near));
    const double tilt = TiltOf(turns, from, onto, found.angles[0]);
    found.miss_rad = tilt <= 2 * kAlongAxis_rad ? 0 : tilt;
    return found;
  }
  const bool cut_second = found.narrow == WhichTurn::kSecond;
  const Vector3d& axis = cut_second ? second : first;
  const Vector3d& other = cut_second ? first : second;
  const Vector3d& v = cut_second ? from : onto;
  const double cosine = axis.dot(v), wanted = other.dot(cut_second ? onto : from);
  const Vector3d along = axis * cosine, radial = v - along;
  const Vector3d across = cut_second ? across_second : Vector3d(-across_first);  // the first turn is taken back
  const Crossings crossings = CrossingsOf(radial.dot(other), across.dot(other), wanted - cosine * axis.dot(other));
  found.count = crossings.reached ? 2 : 1;
  for (std::size_t k = 0; k < static_cast<std::size_t>(found.count); ++k) {
    const Vector3d c = along + radial * crossings.cosine[k] + across * crossings.sine[k];
    const double angle = std::atan2(crossings.sine[k], crossings.cosine[k]);
    found.angles[k] =
        cut_second ? TurnAngles{AngleAbout(first, c, onto), angle} : TurnAngles{angle, AngleAbout(second, from, c)};
  }
  if (!crossings.reached) {
    const double tilt = TiltOf(turns, from, onto, found.angles[0]);
    found.miss_rad = tilt <= kReached_rad ? 0 : tilt;
  }
  return found;
}

TurnChoices NearestTurns(const TwoTurns& turns, const Vector3d& from, const Vector3d& onto, const TurnAngles& near,
                         const TurnLimits& limits, double allowed_tilt_rad) {
  // A free axis stands where it was, or at the limit on the way there.
  const TurnAngles held{Held(near.first_rad, limits.first_minimum_rad, limits.first_maximum_rad),
                        Held(near.second_rad, limits.second_minimum_rad, limits.second_maximum_rad)};
  TurnChoices found;
  found.branches = BranchesOf(turns, from, onto, held);
  const TurnBranches& branches = found.branches;
  const Task task{turns, from, onto, near, limits, allowed_tilt_rad};
  const bool may_tilt = allowed_tilt_rad > 0, near_singular = branches.narrow_sine < std::sin(kNearSingular_rad);
  const double near_rad = Of(branches.narrow, near);
  // A swing that rounding decides, or that does not reach it all the same, is not worth going.
  const bool vain = branches.narrow_sine < kSingularAngle_rad || (near_singular && branches.miss_rad > 0);
  if (may_tilt && branches.free == WhichTurn::kNone && vain) {
    if (const auto stays = task.WithHeldAt(branches.narrow, near_rad)) {
      found.choices[0] = *stays;
      found.count = 1;
      return found;
    }
  }
  std::array<double, 2> distance{};
  for (int k = 0; k < branches.count && branches.miss_rad <= allowed_tilt_rad; ++k) {
    const auto angles = Bounded(branches.angles[static_cast<std::size_t>(k)], near, limits);
    if (!angles) continue;
    const auto at = static_cast<std::size_t>(found.count++);
    found.choices[at] = {*angles, branches.miss_rad, branches.free};
    distance[at] = std::hypot(angles->first_rad - near.first_rad, angles->second_rad - near.second_rad);
  }
  if (found.count == 2 && distance[1] < distance[0]) std::swap(found.choices[0], found.choices[1]);
  if (!may_tilt || !near_singular || branches.free != WhichTurn::kNone) return found;
  if (found.count == 0) {
    if (const auto stays = task.WithHeldAt(branches.narrow, near_rad)) {
      found.choices[0] = *stays;
      found.count = 1;
    }
    return found;
  }
  const double exact_rad = Of(branches.narrow, found.choices[0].angles);
  if (std::abs(exact_rad - near_rad) <= kLongSwing_rad) return found;
  if (const auto least = task.LeastSwing(branches.narrow, exact_rad)) found.choices[0] = *least;
  return found;
}

}  // namespace sixpoint::metrology
