// A mesh's bytes for storage: little-endian, versioned, self-describing; equal meshes give equal bytes.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

std::string MeshBytes(const TriangleMesh& mesh);

// INVALID_ARGUMENT for bytes that are no such mesh, without allocating more than they could hold.
absl::StatusOr<TriangleMesh> MeshFromBytes(const std::string& bytes);

}  // namespace sixpoint::metrology
