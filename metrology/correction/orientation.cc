#include "metrology/correction/orientation.h"

#include <absl/status/status.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>

#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDeg = 180 / kPi;

std::string Text(const char* format, double first, double second = 0, double third = 0, double fourth = 0) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, first, second, third, fourth);
  return buffer;
}

// The whole turn of the angle that lies within [minimum, maximum], nearest to `near`.
std::optional<double> WithinLimits(double angle, double near, double minimum, double maximum) {
  constexpr double kSlack = 1e-12;  // a limit that is met exactly is met
  std::optional<double> best;
  const double turn = 2 * kPi;
  const double first = std::ceil((minimum - kSlack - angle) / turn);
  const double last = std::floor((maximum + kSlack - angle) / turn);
  const double wanted = std::round((near - angle) / turn);
  if (first <= last) best = angle + turn * std::fmin(std::fmax(wanted, first), last);
  return best;
}

absl::StatusOr<RotaryAngles> Nearest(const RotaryAngles (&branches)[2], const RotaryAngles& near,
                                     const RotaryLimits& limits) {
  std::optional<RotaryAngles> best;
  double best_distance = std::numeric_limits<double>::infinity();
  for (const RotaryAngles& branch : branches) {
    const auto a = WithinLimits(branch.a_rad, near.a_rad, limits.a_minimum_rad, limits.a_maximum_rad);
    const auto b = WithinLimits(branch.b_rad, near.b_rad, limits.b_minimum_rad, limits.b_maximum_rad);
    if (!a || !b) continue;
    const double distance = std::hypot(*a - near.a_rad, *b - near.b_rad);
    if (distance < best_distance) {
      best = RotaryAngles{*a, *b};
      best_distance = distance;
    }
  }
  if (!best) {
    return absl::OutOfRangeError(Text("a_deg, b_deg: %.6f, %.6f", branches[0].a_rad * kDeg, branches[0].b_rad * kDeg) +
                                 Text(" or %.6f, %.6f, want a", branches[1].a_rad * kDeg, branches[1].b_rad * kDeg) +
                                 Text(" within %g..%g and b within %g..%g", limits.a_minimum_rad * kDeg,
                                      limits.a_maximum_rad * kDeg, limits.b_minimum_rad * kDeg,
                                      limits.b_maximum_rad * kDeg));
  }
  return *best;
}

absl::Status CheckUnit(const Eigen::Vector3d& direction) {
  // A hole axis has been through a rotation read from text: allow its rounding.
  if (std::abs(direction.norm() - 1) < 1e-6) return absl::OkStatus();
  return Refuse("axis_in_zero", Text("(%g, %g, %g)", direction.x(), direction.y(), direction.z()), "a unit direction");
}

// Angle about the unit axis that turns `from` onto `to`, both seen along the axis.
double AngleAbout(const Eigen::Vector3d& axis, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d u = from - axis * axis.dot(from), v = to - axis * axis.dot(to);
  return std::atan2(axis.dot(u.cross(v)), u.dot(v));
}

absl::StatusOr<RotaryAngles> OrientExactly(const RotaryAxes& axes, const Eigen::Vector3d& direction_in_zero,
                                           const RotaryAngles& near, const RotaryLimits& limits) {
  if (absl::Status status = CheckUnit(direction_in_zero); !status.ok()) return status;
  const Eigen::Vector3d v = direction_in_zero.normalized(), z = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d wa = axes.a.direction.normalized(), wb = axes.b.direction.normalized();
  const Eigen::Vector3d across = wa.cross(wb);
  if (across.norm() < kSingularAngle_rad)
    return absl::FailedPreconditionError("axes: A and B are parallel, want two different directions (singular)");
  if (wa.cross(z).norm() < kSingularAngle_rad)
    return absl::FailedPreconditionError("axes.a: along Z, want a direction across it: A is free there (singular)");
  if (wb.cross(v).norm() < kSingularAngle_rad) {
    return absl::FailedPreconditionError(
        Text("axis_in_zero: (%.6f, %.6f, %.6f), want a direction that is not along the B axis: B is free there"
             " (singular)",
             v.x(), v.y(), v.z()));
  }
  // c = R_B(b) v = R_A(-a) z lies on both cones: c.wb = v.wb and c.wa = z.wa, and is a unit vector.
  const double m = wa.dot(wb), p = wa.dot(z), q = wb.dot(v);
  const double alpha = (p - m * q) / (1 - m * m), beta = (q - m * p) / (1 - m * m);
  const double gamma2 = (1 - alpha * alpha - beta * beta - 2 * alpha * beta * m) / across.squaredNorm();
  if (!(gamma2 >= 0)) {
    return absl::OutOfRangeError(
        Text("axis_in_zero: (%.6f, %.6f, %.6f), want a direction that A and B can turn onto +Z (unreachable)", v.x(),
             v.y(), v.z()));
  }
  RotaryAngles branches[2];
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector3d c = alpha * wa + beta * wb + (k == 0 ? 1 : -1) * std::sqrt(gamma2) * across;
    branches[k] = {AngleAbout(wa, c, z), AngleAbout(wb, v, c)};
  }
  return Nearest(branches, near, limits);
}

// The outer angle that brings the direction nearest to +Z at that inner angle; none within the limits.
std::optional<RotaryAngles> AtInner(const RotaryAxes& axes, const Eigen::Vector3d& v, double b_rad,
                                    const RotaryAngles& near, const RotaryLimits& limits) {
  const Eigen::Vector3d c = Eigen::AngleAxisd(b_rad, axes.b.direction.normalized()) * v;
  const Eigen::Vector3d wa = axes.a.direction.normalized();
  const auto a =
      WithinLimits(AngleAbout(wa, c, Eigen::Vector3d::UnitZ()), near.a_rad, limits.a_minimum_rad, limits.a_maximum_rad);
  if (!a || b_rad < limits.b_minimum_rad || b_rad > limits.b_maximum_rad) return std::nullopt;
  return RotaryAngles{*a, b_rad};
}

// The least swing of the inner axis, on the way to the exact angle, that leaves no more tilt than is allowed.
std::optional<RotaryAngles> OrientByLeastSwing(const RotaryAxes& axes, const Eigen::Vector3d& v,
                                               const absl::StatusOr<RotaryAngles>& exact, const RotaryAngles& near,
                                               const RotaryLimits& limits, double allowed_tilt_rad) {
  const auto at = [&](double part) -> std::optional<RotaryAngles> {
    const double b_rad = exact.ok() ? near.b_rad + part * (exact->b_rad - near.b_rad) : near.b_rad;
    const auto angles = AtInner(axes, v, b_rad, near, limits);
    return angles && TiltOf(axes, v, *angles) <= allowed_tilt_rad ? angles : std::nullopt;
  };
  std::optional<RotaryAngles> best = at(0);
  if (best || !exact.ok()) return best;
  constexpr int kHalvings = 40;
  double low = 0, high = 1;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (low + high) / 2;
    if (auto angles = at(middle)) {
      best = angles;
      high = middle;
    } else {
      low = middle;
    }
  }
  return best;
}

}  // namespace

double TiltOf(const RotaryAxes& axes, const Eigen::Vector3d& direction_in_zero, const RotaryAngles& angles) {
  const Eigen::Vector3d turned = axes.MachineFromZero(angles.a_rad, angles.b_rad).linear() * direction_in_zero;
  return std::atan2(turned.cross(Eigen::Vector3d::UnitZ()).norm(), turned.z());
}

absl::StatusOr<RotaryAngles> Orient(const RotaryAxes& axes, const Eigen::Vector3d& direction_in_zero,
                                    const RotaryAngles& near, const RotaryLimits& limits, double allowed_tilt_rad) {
  const absl::StatusOr<RotaryAngles> exact = OrientExactly(axes, direction_in_zero, near, limits);
  if (!(allowed_tilt_rad > 0) || absl::IsInvalidArgument(exact.status())) return exact;
  if (exact.ok() && std::abs(exact->b_rad - near.b_rad) <= kLongSwing_rad) return exact;
  const Eigen::Vector3d v = direction_in_zero.normalized();
  if (axes.b.direction.normalized().cross(v).norm() >= std::sin(kNearSingular_rad)) return exact;
  const auto least = OrientByLeastSwing(axes, v, exact, near, limits, allowed_tilt_rad);
  if (least) return *least;
  return exact;
}

}  // namespace sixpoint::metrology
