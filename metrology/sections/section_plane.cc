#include "metrology/sections/section_plane.h"

#include "refusal/refusal.h"

namespace sixpoint::metrology {

absl::StatusOr<Eigen::Isometry3d> PartFromSection(const SectionPlane& plane) {
  constexpr double kGreatestMm = 1e7, kLeastSine = 1e-3;
  if (!plane.origin_mm.allFinite() || plane.origin_mm.cwiseAbs().maxCoeff() > kGreatestMm)
    return Refuse("plane.origin_mm", plane.origin_mm.cwiseAbs().maxCoeff(), "finite, at most 1e7");
  if (!plane.normal.allFinite() || !(plane.normal.norm() > 1e-9))
    return Refuse("plane.normal", plane.normal.norm(), "a finite direction");
  const Eigen::Vector3d z = plane.normal.normalized();
  if (!plane.reference.allFinite() || !(plane.reference.norm() > 1e-9))
    return Refuse("plane.reference", plane.reference.norm(), "a finite direction");
  const Eigen::Vector3d across = plane.reference.normalized() - z * z.dot(plane.reference.normalized());
  if (across.norm() < kLeastSine) return Refuse("plane.reference", across.norm(), "a direction across the normal");
  Eigen::Isometry3d part_from_section = Eigen::Isometry3d::Identity();
  part_from_section.linear().col(0) = across.normalized();
  part_from_section.linear().col(1) = z.cross(across.normalized());
  part_from_section.linear().col(2) = z;
  part_from_section.translation() = plane.origin_mm;
  return part_from_section;
}

}  // namespace sixpoint::metrology
