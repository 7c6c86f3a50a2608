#include "bench/correction/closed_forms.h"

#include <cmath>

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;

struct AbAngles {
  double a = 0, b = 0;
};

std::array<AbAngles, 2> AnglesOfAb(const Vector3d& v) {
  std::array<AbAngles, 2> angles;
  for (int k = 0; k < 2; ++k) {
    const double b = std::atan2(v.y(), v.z()) + k * M_PI;
    angles[static_cast<size_t>(k)] = {std::atan2(-v.x(), v.y() * std::sin(b) + v.z() * std::cos(b)), b};
  }
  return angles;
}

Commands AtAb(const Vector3d& c_mm, const Vector3d& tip_mm, const AbAngles& angles) {
  const double sa = std::sin(angles.a), ca = std::cos(angles.a), sb = std::sin(angles.b), cb = std::cos(angles.b);
  const Vector3d r = tip_mm - c_mm;
  const double y = cb * r.y() - sb * r.z(), z = sb * r.y() + cb * r.z();
  Commands commands;
  commands << angles.a, angles.b, c_mm.x() + ca * r.x() + sa * z, c_mm.y() + y, c_mm.z() - sa * r.x() + ca * z;
  return commands;
}

}  // namespace

std::array<Commands, 2> OfAbTable(const Vector3d& c_mm, const Vector3d& tip_mm, const Vector3d& axis) {
  const auto angles = AnglesOfAb(axis);
  return {AtAb(c_mm, tip_mm, angles[0]), AtAb(c_mm, tip_mm, angles[1])};
}

Commands NearestOfAbTable(const Vector3d& c_mm, const Vector3d& tip_mm, const Vector3d& axis, double nominal_a_rad,
                          double nominal_b_rad) {
  auto angles = AnglesOfAb(axis);
  double distance[2];
  for (size_t k = 0; k < 2; ++k) {
    angles[k].a += 2 * M_PI * std::round((nominal_a_rad - angles[k].a) / (2 * M_PI));
    angles[k].b += 2 * M_PI * std::round((nominal_b_rad - angles[k].b) / (2 * M_PI));
    distance[k] = std::hypot(angles[k].a - nominal_a_rad, angles[k].b - nominal_b_rad);
  }
  return AtAb(c_mm, tip_mm, angles[distance[1] < distance[0] ? 1 : 0]);
}

std::array<Commands, 2> OfTiltRotaryTable(double z12_mm, const Vector3d& tip_mm, const Vector3d& v) {
  std::array<Commands, 2> both;
  for (const double way : {1.0, -1.0}) {
    const double sb = way * std::hypot(v.x(), v.y()), cb = v.z();
    const double c = std::atan2(way * v.y(), -way * v.x()), sc = std::sin(c), cc = std::cos(c);
    const Vector3d p = tip_mm + Vector3d(0, 0, z12_mm);
    both[way > 0 ? 0 : 1] << p.dot(Vector3d(-cc * cb, sc * cb, -sb)), p.dot(Vector3d(-sc, -cc, 0)), std::atan2(sb, cb),
        c, p.dot(Vector3d(-cc * sb, sc * sb, cb)) - z12_mm;
  }
  return both;
}

}  // namespace sixpoint::bench
