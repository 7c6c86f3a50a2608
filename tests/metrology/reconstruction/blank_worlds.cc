#include "tests/metrology/reconstruction/blank_worlds.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace sixpoint::testing {

using Eigen::Vector3d;
using metrology::Surface;
using metrology::TriangleMesh;

std::vector<BlankPoint> BlankPoints(const Surface& design, const std::vector<metrology::DesignPlace>& places,
                                    const BlankOf& blank) {
  constexpr double kStep_mm = 0.01;
  std::vector<BlankPoint> points;
  for (const metrology::DesignPlace& place : places) {
    const Vector3d one = place.normal.unitOrthogonal(), other = place.normal.cross(one);
    bool is_smooth = true;
    const auto beside = [&](const Vector3d& along) {
      const metrology::SurfacePoint on = design.Closest(place.point_mm + kStep_mm * along, place.triangle);
      is_smooth = is_smooth && on.feature == metrology::SurfaceFeature::kFace && on.edge_distance_mm > kStep_mm &&
                  on.normal.dot(place.normal) > 0.95;
      return blank(on.point_mm, on.normal);
    };
    const Vector3d outward = (beside(one) - beside(-one)).cross(beside(other) - beside(-other)).normalized();
    // Where the differences fold, nothing is known of how the blank looks.
    if (!is_smooth || outward.dot(place.normal) < 0.5) continue;
    points.push_back({place.point_mm, place.normal, blank(place.point_mm, place.normal), outward});
  }
  return points;
}

std::vector<metrology::BlankPatch> Measured(const std::vector<BlankPoint>& points, double uncertainty_mm,
                                            bool heavy_tails, std::mt19937_64* random) {
  constexpr int kPointsOfPatch = 60;
  std::normal_distribution<double> normal(0, 1);
  std::student_t_distribution<double> student(3);
  std::vector<metrology::BlankPatch> patches;
  for (const BlankPoint& point : points) {
    double draw = normal(*random);
    if (heavy_tails) {
      draw = 0;
      for (int k = 0; k < kPointsOfPatch; ++k) draw += student(*random) / std::sqrt(3.0 * kPointsOfPatch);
    }
    patches.push_back({point.point_mm + uncertainty_mm * draw * point.outward, point.outward, uncertainty_mm});
  }
  return patches;
}

std::shared_ptr<const Surface> LensBlade(const Vector3d& half_axes_mm, int steps) {
  // A sphere as a refined octahedron, stretched.
  TriangleMesh mesh;
  const auto add = [&](const Vector3d& on_sphere) {
    mesh.vertices_mm.push_back(on_sphere.cwiseProduct(half_axes_mm));
    return static_cast<std::uint32_t>(mesh.vertices_mm.size() - 1);
  };
  const auto normal_of = [&](std::uint32_t v) {
    return Vector3d(mesh.vertices_mm[v].array() / half_axes_mm.array().square()).normalized();
  };
  std::vector<std::uint32_t> ring_before, ring;
  const int around = 2 * steps;
  const double pi = std::acos(-1.0);
  const std::uint32_t bottom = add(Vector3d(0, 0, -1));
  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.triangles.push_back({a, b, c});
    mesh.corner_normals.push_back({normal_of(a).cast<float>(), normal_of(b).cast<float>(), normal_of(c).cast<float>()});
  };
  for (int i = 1; i < steps; ++i) {
    const double height = -std::cos(pi * i / steps), radius = std::sin(pi * i / steps);
    ring.clear();
    for (int k = 0; k < around; ++k)
      ring.push_back(
          add(Vector3d(radius * std::cos(2 * pi * k / around), radius * std::sin(2 * pi * k / around), height)));
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const std::size_t next = (k + 1) % ring.size();
      if (ring_before.empty()) {
        triangle(bottom, ring[next], ring[k]);
      } else {
        triangle(ring_before[k], ring_before[next], ring[next]);
        triangle(ring_before[k], ring[next], ring[k]);
      }
    }
    ring_before = ring;
  }
  const std::uint32_t top = add(Vector3d(0, 0, 1));
  for (std::size_t k = 0; k < ring.size(); ++k) triangle(ring[k], ring[(k + 1) % ring.size()], top);
  return *Surface::Prepare(std::move(mesh));
}

std::shared_ptr<const Surface> MovedSurface(const Surface& design, const metrology::FreeFormDeformation& deformation) {
  TriangleMesh mesh = design.mesh();
  const metrology::Points before_mm = mesh.vertices_mm;
  for (Vector3d& vertex : mesh.vertices_mm) vertex += deformation.DisplacementAt(vertex).value();
  for (std::size_t t = 0; t < mesh.corner_normals.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto local = deformation.LocalAt(before_mm[mesh.triangles[t][k]]);
      Eigen::Vector3f& normal = mesh.corner_normals[t][k];
      normal = (local->Jacobian().inverse().transpose() * normal.cast<double>()).normalized().cast<float>();
    }
  return *Surface::Prepare(std::move(mesh));
}

double Ramp(double t) {
  t = std::min(1.0, std::max(0.0, t));
  return t * t * t * t * (35 - t * (84 - t * (70 - 20 * t)));
}

}  // namespace sixpoint::testing
