// How far a point is from a closed mesh, by all its triangles in turn: slow, and with nothing to go wrong.
#pragma once

#include <Eigen/Core>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::bench {

// From the flat triangles, in mm, positive outside: the sign by the angle under which the whole surface is seen (4 pi inside, 0 outside).
double SignedDistanceByAllTriangles(const metrology::TriangleMesh& mesh, const Eigen::Vector3d& point_mm);

}  // namespace sixpoint::bench
