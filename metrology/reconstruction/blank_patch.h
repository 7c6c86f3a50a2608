// What was measured of a blank, patch by patch.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "metrology/inspection/deviation_map.h"

namespace sixpoint::metrology {

struct BlankPatch {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();  // on the blank, part frame, after its fit
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // of the blank there, outward, unit
  double standard_uncertainty_mm = 0;                  // of the point along the normal
};

// The patches that a map has seen: each at its middle on the design, off by its mean.
std::vector<BlankPatch> BlankPatchesOf(const DeviationField& field, const Surface& surface);

}  // namespace sixpoint::metrology
