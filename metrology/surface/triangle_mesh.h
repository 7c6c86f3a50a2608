// A part's surface as triangles, and its bytes for storage.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

struct TriangleMesh {
  Points vertices_mm;  // part frame; shared between the triangles of a face, welded across faces
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise seen from outside
  // Unit normal of the true surface at each triangle's corners; empty where the source (STL) knows none.
  std::vector<std::array<Eigen::Vector3f, 3>> corner_normals;
  std::vector<std::uint16_t> faces;  // CAD face of each triangle; empty: one face
  double chordal_error_um = 0;       // greatest distance found between triangles and the true surface
  bool closed = false;
};

// Little-endian, versioned, self-describing; equal meshes give equal bytes. Refuses bytes that are not such a mesh,
// without allocating more than they could hold.
std::string MeshBytes(const TriangleMesh& mesh);
absl::StatusOr<TriangleMesh> MeshFromBytes(const std::string& bytes);

}  // namespace sixpoint::metrology
