// Clouds of a snapshot sensor as no model of ours has them: a camera's views with what it cannot see, noise that grows with the incidence, a
// smooth distortion of each view, views that were merged a little beside one another, strays and a clump of reflections, in any order.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

struct SnapshotWorld {
  int view_count = 3;
  std::size_t points_per_view = 6'000;
  double noise_mm = 3e-3;       // along the ray, seen head-on; as 1 / cos of the incidence
  double distortion_mm = 2e-3;  // root mean square over a view, in waves longer than the part
  double misaligned_mm = 4e-3;  // of each view: root mean square of its shift, and of its turn at 12 mm
  double stray_share = 0.05, clump_share = 0.02;
  double field_mm = 28;  // half of the cube in which strays lie, about the part's middle
  double camera_mm = 300;
};

// Whether the way from p, a little off the surface, to the camera meets a triangle (Moeller and Trumbore).
inline bool IsHidden(const TriangleMesh& body, const Eigen::Vector3d& p, const Eigen::Vector3d& camera) {
  const Eigen::Vector3d way = camera - p;
  for (const auto& t : body.triangles) {
    const Eigen::Vector3d &a = body.vertices_mm[t[0]], u = body.vertices_mm[t[1]] - a, v = body.vertices_mm[t[2]] - a;
    const Eigen::Vector3d h = way.cross(v);
    const double det = u.dot(h);
    if (std::abs(det) < 1e-12) continue;
    const Eigen::Vector3d s = p - a, q = s.cross(u);
    const double one = s.dot(h) / det, other = way.dot(q) / det, at = v.dot(q) / det;
    if (one >= 0 && other >= 0 && one + other <= 1 && at > 0 && at < 1) return true;
  }
  return false;
}

// What one view is off by along its direction, over the plane across it.
class ViewDistortion {
 public:
  ViewDistortion(double root_mean_square_mm, std::mt19937_64* random) {
    std::uniform_real_distribution<double> unit(0, 1);
    constexpr int kWaves = 4;
    for (int i = 0; i < kWaves; ++i) {
      const double turn = 2 * M_PI * unit(*random), wavelength_mm = 50 + 80 * unit(*random);
      waves_.push_back({2 * M_PI / wavelength_mm * std::cos(turn), 2 * M_PI / wavelength_mm * std::sin(turn),
                        2 * M_PI * unit(*random), root_mean_square_mm * std::sqrt(2.0 / kWaves)});
    }
  }
  double At(double x_mm, double y_mm) const {
    double sum = 0;
    for (const Wave& w : waves_) sum += w.height_mm * std::sin(w.by_x * x_mm + w.by_y * y_mm + w.phase);
    return sum;
  }

 private:
  struct Wave {
    double by_x, by_y, phase, height_mm;
  };
  std::vector<Wave> waves_;
};

// Part frame. body: what hides points, coarser than the surface.
inline Points SnapshotOf(const Surface& surface, const TriangleMesh& body, const SnapshotWorld& world,
                         std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> gauss(0, 1);
  const auto draw = [&](double sigma) -> Eigen::Vector3d {
    const double x = gauss(random), y = gauss(random), z = gauss(random);
    return sigma * Eigen::Vector3d(x, y, z);
  };
  const Eigen::Vector3d middle = surface.centroid_mm();
  const TriangleMesh& mesh = surface.mesh();
  std::vector<double> areas;
  for (const auto& t : mesh.triangles)
    areas.push_back((mesh.vertices_mm[t[1]] - mesh.vertices_mm[t[0]])
                        .cross(mesh.vertices_mm[t[2]] - mesh.vertices_mm[t[0]])
                        .norm());
  std::discrete_distribution<std::size_t> pick(areas.begin(), areas.end());
  Points cloud;
  const double first = 2 * M_PI * unit(random);
  for (int view = 0; view < world.view_count; ++view) {
    // Around the span, from above and below in turn.
    const double around = first + 2 * M_PI * view / world.view_count,
                 up = (view % 2 == 0 ? 1 : -1) * (0.3 + 0.4 * unit(random));
    const Eigen::Vector3d towards(std::cos(around) * std::cos(up), std::sin(around) * std::cos(up), std::sin(up));
    const Eigen::Vector3d across = towards.unitOrthogonal(), along = towards.cross(across);
    const Eigen::Vector3d camera = middle + world.camera_mm * towards;
    const ViewDistortion distortion(world.distortion_mm, &random);
    const Eigen::Matrix3d turned = RotationFromVector(draw(world.misaligned_mm / std::sqrt(3.0) / 12));
    const Eigen::Vector3d shifted = draw(world.misaligned_mm / std::sqrt(3.0));
    for (std::size_t count = 0; count < world.points_per_view;) {
      const auto& t = mesh.triangles[pick(random)];
      const double r = std::sqrt(unit(random)), s = unit(random);
      const SurfacePoint on = surface.Closest((1 - r) * mesh.vertices_mm[t[0]] + r * (1 - s) * mesh.vertices_mm[t[1]] +
                                              r * s * mesh.vertices_mm[t[2]]);
      const Eigen::Vector3d ray = (camera - on.point_mm).normalized();
      const double cosine = ray.dot(on.normal);
      // As many points as the pixels see of it, none beyond 75 degrees.
      if (cosine < 0.26 || unit(random) > cosine || IsHidden(body, on.point_mm + 0.3 * on.normal, camera)) continue;
      const Eigen::Vector3d from = on.point_mm - middle;
      const double along_ray =
          world.noise_mm / cosine * gauss(random) + distortion.At(from.dot(across), from.dot(along));
      const Eigen::Vector3d seen = from + along_ray * ray + draw(0.2 * world.noise_mm);
      cloud.push_back(middle + turned * seen + shifted);
      ++count;
    }
  }
  const auto of_surface = static_cast<double>(cloud.size());
  for (int i = 0; i < world.stray_share * of_surface; ++i) {
    const double x = unit(random), y = unit(random), z = unit(random);
    cloud.push_back(middle + world.field_mm * (2 * Eigen::Vector3d(x, y, z) - Eigen::Vector3d::Ones()));
  }
  // A reflection stands off the surface, as a body of its own.
  const Eigen::Vector3d at = cloud[static_cast<std::size_t>(unit(random) * of_surface)];
  const SurfacePoint under = surface.Closest(at);
  for (int i = 0; i < world.clump_share * of_surface; ++i)
    cloud.push_back(under.point_mm + (0.4 + 0.2 * unit(random)) * under.normal + draw(0.4));
  std::shuffle(cloud.begin(), cloud.end(), random);
  return cloud;
}

}  // namespace sixpoint::metrology
