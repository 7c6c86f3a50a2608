// Where a part is cut: a plane, and the direction in it that angles are counted from.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>

namespace sixpoint::metrology {

// Part frame. Normal and reference have any length; of the reference what lies in the plane counts. For heights along the part's z: the
// default, with origin_mm at the height.
struct SectionPlane {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d reference = Eigen::Vector3d::UnitX();
};

// Section frame: x along the reference, z along the normal, its origin that of the plane. INVALID_ARGUMENT: not finite, or a reference
// that is along the normal.
absl::StatusOr<Eigen::Isometry3d> PartFromSection(const SectionPlane& plane);

}  // namespace sixpoint::metrology
