// A tetrahedron with the corner at `origin` and legs of 1 mm along the axes: volume 1/6, seen from outside.
#pragma once

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

inline TriangleMesh Tetrahedron(const Eigen::Vector3d& origin = Eigen::Vector3d::Zero()) {
  TriangleMesh mesh;
  mesh.vertices_mm = {origin, origin + Eigen::Vector3d::UnitX(), origin + Eigen::Vector3d::UnitY(),
                      origin + Eigen::Vector3d::UnitZ()};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  mesh.closed = true;
  return mesh;
}

}  // namespace sixpoint::metrology
