// A part's surface as triangles.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

inline constexpr double kGreatestCoordinateMm = 1e7;

using TriangleCorners = std::array<std::uint32_t, 3>;  // vertices

struct TriangleMesh {
  Points vertices_mm;                      // part frame; shared between the triangles of a face, welded across faces
  std::vector<TriangleCorners> triangles;  // counter-clockwise seen from outside
  // Unit normal of the true surface at each triangle's corners; empty where the source (STL) knows none.
  std::vector<std::array<Eigen::Vector3f, 3>> corner_normals;
  std::vector<std::uint16_t> faces;  // CAD face of each triangle; empty: one face
  double chordal_error_um = 0;       // greatest distance found between triangles and the true surface
  bool closed = false;
  // Of each vertex, how far the CAD's faces that meet there are from it: 0 where that is nothing to speak of. Empty: nowhere is.
  std::vector<float> face_gaps_mm;
  double healed_mm = 0;  // how far an edge of the CAD lay off its faces before it was put onto them; 0 as above
};

// Of the vertices that triangles use, part frame; isEmpty() where there is no triangle.
inline Eigen::AlignedBox3d BoundsOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d bounds_mm;
  for (const TriangleCorners& corners : mesh.triangles)
    for (const std::uint32_t v : corners) bounds_mm.extend(mesh.vertices_mm[v]);
  return bounds_mm;
}

}  // namespace sixpoint::metrology
