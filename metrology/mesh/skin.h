// Whether the triangles of a mesh are the skin of a body, and what keeps them from it.
#pragma once

#include <absl/status/status.h>

#include <cstdint>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

// Every edge belongs to exactly two triangles, which run along it in opposite senses; there is a triangle.
bool IsClosed(const TriangleMesh& mesh);

// INVALID_ARGUMENT with count and place (of the first edge's middle): edges that more than two triangles share, and
// neighbours of which one is turned over, so that the mesh has no outside. Open rims are allowed.
absl::Status CheckOneSided(const TriangleMesh& mesh);

// What keeps a mesh from being a whole skin, though it can be measured against: for an engineer to see.
struct MeshGaps {
  std::int64_t degenerate_triangle_count = 0;  // without area: no part of the surface
  std::int64_t open_rim_count = 0;             // edges of one triangle only, connected ones together: a hole has one
  double open_rim_length_mm = 0;               // of all of them
};
MeshGaps GapsOf(const TriangleMesh& mesh);

// Turns every triangle and normal over.
void TurnOver(TriangleMesh* mesh);

}  // namespace sixpoint::metrology
