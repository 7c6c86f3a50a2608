// STL, binary and ASCII, by a bounded reader of our own.
#pragma once

#include <absl/status/statusor.h>

#include <string_view>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

// unit_mm: one unit of the file in millimetres (STL does not say). Equal corners are welded, triangles without area
// dropped; a body that was written inside out is turned. corner_normals stay empty: the file's facet normals are those
// of its own triangles. INVALID_ARGUMENT for bytes that are no STL, counts that do not match the length, non-finite
// numbers or beyond 1e7 mm, no triangle with an area, edges that more than two triangles share, neighbours turned against
// each other.
absl::StatusOr<TriangleMesh> ReadStl(std::string_view bytes, double unit_mm);

}  // namespace sixpoint::metrology
