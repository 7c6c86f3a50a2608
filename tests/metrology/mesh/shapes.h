// Meshes of shapes whose true surface is known, with and without corner normals.
#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology::shapes {

// A grid over (u, v) in [0, 1)^2 (u closed on itself; v closed too, or open at its ends), as triangles with true normals.
inline TriangleMesh Grid(const std::function<Eigen::Vector3d(double, double)>& point, int around, int along,
                         bool v_closed) {
  TriangleMesh mesh;
  const int rows = v_closed ? along : along + 1;
  const auto normal = [&](int i, int j) -> Eigen::Vector3f {
    const double u = static_cast<double>(i) / around, v = static_cast<double>(j) / along, h = 1e-5;
    const Eigen::Vector3d du = point(u + h, v) - point(u - h, v), dv = point(u, v + h) - point(u, v - h);
    return du.cross(dv).normalized().cast<float>();
  };
  std::vector<Eigen::Vector3f> normals;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < around; ++i) {
      mesh.vertices_mm.push_back(point(static_cast<double>(i) / around, static_cast<double>(j) / along));
      normals.push_back(normal(i, j));
    }
  const auto index = [&](int i, int j) { return static_cast<std::uint32_t>((j % rows) * around + i % around); };
  for (int j = 0; j < along; ++j)
    for (int i = 0; i < around; ++i) {
      const std::uint32_t a = index(i, j), b = index(i + 1, j), c = index(i + 1, j + 1), d = index(i, j + 1);
      for (const std::array<std::uint32_t, 3>& t : {std::array<std::uint32_t, 3>{a, b, c}, {a, c, d}}) {
        mesh.triangles.push_back(t);
        mesh.corner_normals.push_back({normals[t[0]], normals[t[1]], normals[t[2]]});
      }
    }
  mesh.closed = v_closed;
  return mesh;
}

inline TriangleMesh Torus(double major_mm, double minor_mm, int around, int along, const Eigen::Vector3d& centre_mm) {
  return Grid(
      [=](double u, double v) {
        const double a = 2 * M_PI * v, b = 2 * M_PI * u;
        return Eigen::Vector3d(centre_mm + Eigen::Vector3d((major_mm + minor_mm * std::cos(b)) * std::sin(a),
                                                           (major_mm + minor_mm * std::cos(b)) * std::cos(a),
                                                           minor_mm * std::sin(b)));
      },
      around, along, true);
}

// A twisted, tapering blade along z (span 40 mm, chord about 24 mm, elliptic sections), with a flat cap at either end.
inline TriangleMesh Blade(int around, int along, const Eigen::Vector3d& centre_mm) {
  const auto point = [=](double u, double v) {
    const double twist = 0.6 * (v - 0.5), scale = 1 - 0.25 * v, a = 2 * M_PI * u;
    const double x = 12 * scale * std::cos(a), y = 2.5 * scale * std::sin(a) + 0.012 * x * x;
    return Eigen::Vector3d(centre_mm + Eigen::Vector3d(std::cos(twist) * x - std::sin(twist) * y,
                                                       std::sin(twist) * x + std::cos(twist) * y, 40 * (v - 0.5)));
  };
  TriangleMesh mesh = Grid(point, around, along, false);
  for (const int end : {0, along}) {
    const auto middle = static_cast<std::uint32_t>(mesh.vertices_mm.size());
    const Eigen::Vector3f up(0, 0, end == 0 ? -1.f : 1.f);
    mesh.vertices_mm.push_back(point(0, static_cast<double>(end) / along) * 0.5 +
                               point(0.5, static_cast<double>(end) / along) * 0.5);
    mesh.vertices_mm.back() += 0.4 * (point(0.25, static_cast<double>(end) / along) - mesh.vertices_mm.back());
    for (int i = 0; i < around; ++i) {
      const auto p = static_cast<std::uint32_t>(end * around + i),
                 q = static_cast<std::uint32_t>(end * around + (i + 1) % around);
      if (end == 0)
        mesh.triangles.push_back({middle, q, p});
      else
        mesh.triangles.push_back({middle, p, q});
      mesh.corner_normals.push_back({up, up, up});
    }
  }
  mesh.closed = true;
  return mesh;
}

// A twisted aerofoil along z (span 80 mm, chord 40 mm), flat triangles: those at its sharp trailing edge are micrometres wide,
// and those of its caps, fans from one point, run along the rim behind it.
inline TriangleMesh Aerofoil(int around, int along) {
  TriangleMesh mesh;
  for (int j = 0; j <= along; ++j)
    for (int i = 0; i < around; ++i) {
      const double v = static_cast<double>(j) / along, a = 2 * M_PI * i / around, x = 0.5 * (1 + std::cos(a));
      const double half =
          0.7 * (0.2969 * std::sqrt(x) - 0.1260 * x - 0.3516 * x * x + 0.2843 * x * x * x - 0.1036 * x * x * x * x);
      const Eigen::Vector2d at =
          Eigen::Rotation2Dd(0.5 * v - 0.2) *
          ((40 - 12 * v) * Eigen::Vector2d(x - 0.45, 0.3 * x * (1 - x) - 0.04 + (2 * i <= around ? half : -half)));
      mesh.vertices_mm.emplace_back(at.x() + 1.5 * v * v, at.y() + v * v, 80 * (v - 0.5));
    }
  const auto index = [&](int i, int j) { return static_cast<std::uint32_t>(j * around + i % around); };
  for (int j = 0; j < along; ++j)
    for (int i = 0; i < around; ++i) {
      mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
      mesh.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  for (const int end : {0, along}) {
    const auto middle = static_cast<std::uint32_t>(mesh.vertices_mm.size());
    mesh.vertices_mm.emplace_back(
        0.5 * (mesh.vertices_mm[index(around / 4, end)] + mesh.vertices_mm[index(around - around / 4, end)]));
    for (int i = 0; i < around; ++i) {
      const std::uint32_t p = index(i, end), q = index(i + 1, end);
      mesh.triangles.push_back(end == 0 ? std::array<std::uint32_t, 3>{middle, q, p}
                                        : std::array<std::uint32_t, 3>{middle, p, q});
    }
  }
  mesh.closed = true;
  return mesh;
}

}  // namespace sixpoint::metrology::shapes
