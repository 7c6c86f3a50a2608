#include "metrology/measuring_plan/surface_samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kSameSide = 0.5;  // cosine

Vector3d AreaVector(const TriangleMesh& mesh, const TriangleCorners& corners) {
  const Vector3d& a = mesh.vertices_mm[corners[0]];
  return 0.5 * (mesh.vertices_mm[corners[1]] - a).cross(mesh.vertices_mm[corners[2]] - a);
}

// Where the k-th place lies in its triangle: Roberts' R2 sequence, folded into it.
Vector3d PlaceIn(const TriangleMesh& mesh, const TriangleCorners& corners, std::size_t k) {
  double u = std::fmod(0.5 + 0.7548776662466927 * static_cast<double>(k), 1.0);
  double v = std::fmod(0.5 + 0.5698402909980532 * static_cast<double>(k), 1.0);
  if (u + v > 1) u = 1 - u, v = 1 - v;
  const Vector3d& a = mesh.vertices_mm[corners[0]];
  return a + u * (mesh.vertices_mm[corners[1]] - a) + v * (mesh.vertices_mm[corners[2]] - a);
}

// Of the triangles that are wanted; every place that is kept.
SurfaceSamples Sampled(const TriangleMesh& mesh, double area_mm2,
                       const std::function<bool(const TriangleCorners&)>& wanted,
                       const std::function<bool(const SurfaceSample&)>& kept) {
  SurfaceSamples sampled;
  sampled.area_mm2 = area_mm2;
  double passed_mm2 = 0;  // in whole pieces and the rest: no sum that loses the small to the great
  std::size_t number = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const TriangleCorners& corners = mesh.triangles[t];
    const Vector3d area = AreaVector(mesh, corners);
    const double size_mm2 = area.norm();
    if (!(size_mm2 > 0) || !wanted(corners)) continue;
    passed_mm2 += size_mm2;
    for (; passed_mm2 >= area_mm2 / 2; passed_mm2 -= area_mm2) {
      const SurfaceSample sample{PlaceIn(mesh, corners, number++), area / size_mm2, t};
      if (kept(sample)) sampled.samples.push_back(sample);
    }
  }
  return sampled;
}

}  // namespace

SurfaceSamples SampleSurface(const TriangleMesh& mesh, std::size_t count) {
  double area_mm2 = 0;
  for (const TriangleCorners& corners : mesh.triangles) area_mm2 += AreaVector(mesh, corners).norm();
  const auto all = [](const auto&) { return true; };
  return Sampled(mesh, area_mm2 / static_cast<double>(std::max<std::size_t>(1, count)), all, all);
}

SurfaceSamples SampleDisc(const TriangleMesh& mesh, const SurfaceDisc& disc, std::size_t count) {
  const auto near = [&](const TriangleCorners& corners) {
    Eigen::AlignedBox3d box_mm;
    for (const std::uint32_t v : corners) box_mm.extend(mesh.vertices_mm[v]);
    return box_mm.exteriorDistance(disc.centre_mm) <= disc.radius_mm;
  };
  const auto within = [&](const SurfaceSample& sample) {
    return (sample.point_mm - disc.centre_mm).norm() <= disc.radius_mm && sample.normal.dot(disc.normal) >= kSameSide;
  };
  double near_mm2 = 0;
  for (const TriangleCorners& corners : mesh.triangles)
    if (near(corners)) near_mm2 += AreaVector(mesh, corners).norm();
  const double disc_mm2 = std::min(near_mm2, kPi * disc.radius_mm * disc.radius_mm);
  return Sampled(mesh, disc_mm2 / static_cast<double>(std::max<std::size_t>(1, count)), near, within);
}

}  // namespace sixpoint::metrology
