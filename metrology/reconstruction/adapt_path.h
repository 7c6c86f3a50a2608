// A template's tool path for the shape that was found: every tool centre point and axis goes with the place of the surface that it cuts, as if
// it were fixed to it (docs/methods/reconstruction.md, path). Geometry alone.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/reconstruction/design_places.h"
#include "metrology/reconstruction/free_form_deformation.h"
#include "metrology/reconstruction/shape_regions.h"

namespace sixpoint::metrology {

struct ToolPoint {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  // of the tool, part frame
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();      // unit, from tip to spindle
};

struct AdaptedToolPoint {
  ToolPoint tool;
  Eigen::Vector3d contact_mm = Eigen::Vector3d::Zero();  // the place of the design that it cuts
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();     // of the design there, outward, unit
  double part = 1;  // of the way that the surface goes there: 1 in machined regions, 0 beyond the strip about them
};

// strip_mm: beside machined regions, over which the path goes back to the template: a Bezier step of degree 5, twice continuously differentiable.
// INVALID_ARGUMENT, by name: "template[i]" outside the lattice, not finite, or without a unit axis; "strip_mm" not 0.01 to 50; "regions" none machined.
absl::StatusOr<std::vector<AdaptedToolPoint>> AdaptPath(const DesignPlaces& design,
                                                        const std::vector<ShapeRegion>& regions,
                                                        const FreeFormDeformation& deformation,
                                                        const std::vector<ToolPoint>& path, double strip_mm);

// Of a surface's surroundings: the rotation nearest to the Jacobian, turned on by the least angle so that the normal stays the normal.
Eigen::Matrix3d TurnOf(const Eigen::Matrix3d& jacobian, const Eigen::Vector3d& normal);

}  // namespace sixpoint::metrology
