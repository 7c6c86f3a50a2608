#include "bench/repair/repair_world.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "metrology/cad/tessellation.h"

namespace sixpoint::bench {

using Eigen::Vector3d;

BladeWorld::BladeWorld(std::uint64_t seed, const Vector3d& low_mm, const Vector3d& high_mm)
    : low_mm_(low_mm), high_mm_(high_mm) {
  std::mt19937_64 random(7000 + seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto between = [&](double least, double most) { return least + (most - least) * unit(random); };
  twist_rad_ = between(-0.008, 0.008);
  twist_power_ = between(0.8, 1.6);
  bend_power_ = between(1.5, 2.5);
  const double bend_mm = between(0, 0.3), bend_to = between(0, 6.2832);
  bend_mm_ = bend_mm * Eigen::Vector2d(std::cos(bend_to), std::sin(bend_to));
  shift_mm_ = {between(-0.01, 0.01), between(-0.01, 0.01)};  // what a fit leaves
  const double span_mm = high_mm.z() - low_mm.z(), all_mm = between(0.005, 0.03);
  for (int k = 0; k < 6; ++k) {
    Vector3d to(between(-1, 1), between(-1, 1), between(-1, 1));
    const double length_mm = span_mm * between(0.4, 2);
    waves_.push_back({6.2832 / length_mm * to.normalized(), between(0, 6.2832), all_mm * between(0, 0.6)});
  }
  leading_wear_mm_ = between(0, 0.15);
  trailing_wear_mm_ = between(0, 0.08);
  wear_reach_mm_ = between(1.5, 4);
  wear_slope_ = between(-0.6, 0.6);
}

Vector3d BladeWorld::Displacement(const Vector3d& point_mm, const Vector3d& normal) const {
  const Vector3d middle = (low_mm_ + high_mm_) / 2;
  const double part = std::max(0.0, (point_mm.z() - low_mm_.z()) / (high_mm_.z() - low_mm_.z()));
  const double twist = twist_rad_ * std::pow(part, twist_power_);
  const Eigen::Vector2d from = (point_mm - middle).head<2>();
  Eigen::Vector2d moved(std::cos(twist) * from.x() - std::sin(twist) * from.y(),
                        std::sin(twist) * from.x() + std::cos(twist) * from.y());
  moved += shift_mm_ + std::pow(part, bend_power_) * bend_mm_ - from;
  double out_mm = 0;
  for (const Wave& wave : waves_) out_mm += wave.height_mm * std::sin(wave.by_mm.dot(point_mm - middle) + wave.phase);
  // Worn where the outline turns most: the leading edge looks to -x, the trailing edge lies lowest in y.
  const double grows = 1 + wear_slope_ * (part - 0.5);
  out_mm -= leading_wear_mm_ * grows * std::exp(-(point_mm.x() - low_mm_.x()) / wear_reach_mm_);
  out_mm -= trailing_wear_mm_ * grows * std::exp(-(point_mm.y() - low_mm_.y()) / wear_reach_mm_);
  moved += out_mm * normal.head<2>();
  return {moved.x(), moved.y(), 0};
}

NominalBlade LoadBlade(const std::string& step_file) {
  NominalBlade blade;
  if (!std::ifstream(step_file)) return blade;
  metrology::TessellationOptions fine;
  fine.chordal_error_um = 1;
  fine.greatest_chordal_error_um = 4;
  const auto mesh = metrology::TessellateCad(metrology::CadFormat::kStep, step_file, fine);
  if (!mesh.ok()) return blade;
  blade.surface = *metrology::Surface::Prepare(*mesh);
  blade.low_mm = blade.surface->minimum_mm();
  blade.high_mm = blade.surface->maximum_mm();
  return blade;
}

WallPoints WallOf(const metrology::Surface& surface, std::size_t count, double from_z_mm, double to_z_mm,
                  std::uint64_t seed) {
  const metrology::TriangleMesh& mesh = surface.mesh();
  std::vector<double> areas;
  std::vector<std::size_t> walls;
  double area = 0;
  const auto corner = [&](std::size_t t, std::size_t k) { return mesh.vertices_mm[mesh.triangles[t][k]]; };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector3d across = (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
    if (std::abs(across.z()) > 0.9 * across.norm()) continue;  // end faces
    areas.push_back(area += across.norm());
    walls.push_back(t);
  }
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> anywhere(0, 1);
  WallPoints made;
  std::uint32_t hint = metrology::Surface::kNoTriangle;
  while (made.points_mm.size() < count) {
    const auto w = std::lower_bound(areas.begin(), areas.end(), area * anywhere(random)) - areas.begin();
    const std::size_t t = walls[static_cast<std::size_t>(w)];
    double u = anywhere(random), v = anywhere(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vector3d a = corner(t, 0), point = a + u * (corner(t, 1) - a) + v * (corner(t, 2) - a);
    if (point.z() < from_z_mm || point.z() > to_z_mm) continue;
    hint = static_cast<std::uint32_t>(t);
    const auto on = surface.Closest(point, hint);
    made.points_mm.push_back(on.point_mm);
    made.normals.push_back(on.normal);
  }
  return made;
}

metrology::Points ScanOf(const WallPoints& wall, const BladeWorld& world, double noise_mm, std::uint64_t seed) {
  std::mt19937_64 random(90000 + seed);
  std::normal_distribution<double> noise(0, noise_mm);
  metrology::Points scan;
  scan.reserve(wall.points_mm.size());
  for (std::size_t i = 0; i < wall.points_mm.size(); ++i)
    scan.push_back(wall.points_mm[i] + world.Displacement(wall.points_mm[i], wall.normals[i]) +
                   noise(random) * wall.normals[i]);
  return scan;
}

}  // namespace sixpoint::bench
