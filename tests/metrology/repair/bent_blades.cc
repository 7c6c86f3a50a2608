#include "tests/metrology/repair/bent_blades.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/metrology/sections/airfoils.h"
#include "tests/metrology/sections/loop_outline.h"

namespace sixpoint::metrology {

using Eigen::Vector2d;

std::vector<Vector2d> KnownPolygon(double z_mm, const SectionMotion& motion) {
  Blade blade;
  blade.arc_mm = 30 - 0.1 * z_mm;
  blade.turning_rad = 1.1;
  blade.stagger_rad = 0.4 + 0.006 * z_mm;
  blade.lead_mm = 1.2 - 0.005 * z_mm;
  blade.trail_mm = 0.5;
  blade.bulge_mm = 2 - 0.02 * z_mm;
  blade.place_mm = {0.05 * z_mm, -0.02 * z_mm};
  std::vector<Vector2d> polygon = PolygonOf(blade, 0.05);
  if (motion)
    for (Vector2d& point_mm : polygon) point_mm += motion(z_mm, point_mm);
  return polygon;
}

BladeSection KnownSection(double z_mm, const SectionMotion& motion) {
  BladeSection section;
  section.z_mm = z_mm;
  section.outline = ChebyshevOutline(LoopOutline(KnownPolygon(z_mm, motion))->fitted.outline);
  section.profile = *ProfileOf(section.outline, {}, CamberMethod::kBisected);
  return section;
}

std::shared_ptr<const Surface> KnownSurface(double from_mm, double to_mm) {
  constexpr double kRise_mm = 0.5;
  constexpr std::size_t kAround = 1500;
  TriangleMesh mesh;
  const auto count = static_cast<std::uint32_t>(std::ceil((to_mm - from_mm) / kRise_mm));
  for (std::uint32_t k = 0; k <= count; ++k) {
    const double z_mm = from_mm + (to_mm - from_mm) * k / count;
    const std::vector<Vector2d> polygon = KnownPolygon(z_mm, nullptr);
    std::vector<double> at_mm = {0};
    for (std::size_t i = 0; i < polygon.size(); ++i)
      at_mm.push_back(at_mm.back() + (polygon[(i + 1) % polygon.size()] - polygon[i]).norm());
    std::size_t i = 0;
    for (std::size_t n = 0; n < kAround; ++n) {
      const double along_mm = at_mm.back() * static_cast<double>(n) / kAround;
      while (at_mm[i + 1] <= along_mm) ++i;
      const Vector2d point = polygon[i] + (along_mm - at_mm[i]) / (at_mm[i + 1] - at_mm[i]) *
                                              (polygon[(i + 1) % polygon.size()] - polygon[i]);
      mesh.vertices_mm.emplace_back(point.x(), point.y(), z_mm);
    }
  }
  constexpr auto kRing = static_cast<std::uint32_t>(kAround);
  for (std::uint32_t k = 0; k < count; ++k)
    for (std::uint32_t n = 0; n < kRing; ++n) {
      const std::uint32_t a = k * kRing + n, b = k * kRing + (n + 1) % kRing;
      mesh.triangles.push_back({a, b, b + kRing});
      mesh.triangles.push_back({a, b + kRing, a + kRing});
    }
  return *Surface::Prepare(std::move(mesh));
}

Points KnownWall(double from_mm, double to_mm, std::size_t count, double noise_mm, const SectionMotion& motion,
                 std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> noise(0, noise_mm);
  constexpr std::size_t kEach = 100;  // of one height
  Points points;
  while (points.size() < count) {
    const double z_mm = from_mm + (to_mm - from_mm) * unit(random);
    const std::vector<Vector2d> polygon = KnownPolygon(z_mm, motion);
    double length_mm = 0;
    std::vector<double> at_mm;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      at_mm.push_back(length_mm);
      length_mm += (polygon[(i + 1) % polygon.size()] - polygon[i]).norm();
    }
    for (std::size_t k = 0; k < kEach; ++k) {
      const double along_mm = length_mm * unit(random);
      const auto i =
          static_cast<std::size_t>(std::upper_bound(at_mm.begin(), at_mm.end(), along_mm) - at_mm.begin()) - 1;
      const Vector2d step = polygon[(i + 1) % polygon.size()] - polygon[i];
      const Vector2d point =
          polygon[i] + (along_mm - at_mm[i]) * step.normalized() - noise(random) * LeftOf(step.normalized());
      points.emplace_back(point.x(), point.y(), z_mm);
    }
  }
  return points;
}

SectionMotion Bent(double bend_mm, double twist_rad, double wave_mm) {
  return [=](double z_mm, const Vector2d& point_mm) -> Vector2d {
    const double part = z_mm / 40, twist = twist_rad * part;
    const Vector2d turned(std::cos(twist) * point_mm.x() - std::sin(twist) * point_mm.y(),
                          std::sin(twist) * point_mm.x() + std::cos(twist) * point_mm.y());
    const double wave = wave_mm * std::sin(0.2 * z_mm + 0.15 * point_mm.x());
    return turned - point_mm + Vector2d(0.6, 0.8) * (bend_mm * part * part + wave);
  };
}

}  // namespace sixpoint::metrology
