#pragma once

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

// An open tube of square section, 2 x 2 x 3 mm, far from its origin; seen from outside.
inline TriangleMesh SquareTube() {
  TriangleMesh mesh;
  const Eigen::Vector3d origin(6350, -20, 320);
  const double xy[4][2] = {{0, 0}, {2, 0}, {2, 2}, {0, 2}};
  for (const double z : {0.0, 3.0})
    for (const auto& corner : xy) mesh.vertices_mm.push_back(origin + Eigen::Vector3d(corner[0], corner[1], z));
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t next = (i + 1) % 4;
    mesh.triangles.push_back({i, next, next + 4});
    mesh.triangles.push_back({i, next + 4, i + 4});
  }
  return mesh;
}

}  // namespace sixpoint::metrology
