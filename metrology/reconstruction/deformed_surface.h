// The shape that was found as a surface of its own, for what looks at surfaces alone: its design's mesh, moved.
#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "metrology/reconstruction/free_form_deformation.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// Corners and their normals go as the deformation has them; the triangles between stay flat, as the design's are. INVALID_ARGUMENT: a corner
// outside the lattice; as Surface::Prepare.
absl::StatusOr<std::shared_ptr<const Surface>> DeformedSurface(const Surface& design,
                                                               const FreeFormDeformation& deformation);

// Of the deformed surface where the design has this normal: outward, unit.
Eigen::Vector3d DeformedNormal(const Eigen::Matrix3d& jacobian, const Eigen::Vector3d& normal);

}  // namespace sixpoint::metrology
