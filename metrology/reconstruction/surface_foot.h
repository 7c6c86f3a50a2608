// Where a point stands beside a deformed surface: the surface is never made anew, its points are moved.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "metrology/reconstruction/free_form_deformation.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// Normals within this cosine's angle are of one wall: at thin edges the nearest is often the other.
inline constexpr double kSameWallCosine = 0.5;
inline bool IsSameWall(const Eigen::Vector3d& one, const Eigen::Vector3d& other) {
  return one.dot(other) > kSameWallCosine;
}

// The place of the design whose deformed point is the foot of the point that was asked for.
struct SurfaceFoot {
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();        // on the design, before it is deformed
  Eigen::Vector3d design_normal = Eigen::Vector3d::UnitZ();  // there
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();         // of the deformed surface, outward, unit
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
  double distance_mm = 0;  // of the point, along the normal, positive outside
  std::uint32_t triangle = Surface::kNoTriangle;
  SurfaceFeature feature = SurfaceFeature::kFace;
};

// deformation: null for none. outward: how the surface looks there; a foot that looks elsewhere is of another wall, and the one that looks alike
// is searched along the direction. Unset: none within farthest_mm, or outside the lattice. near: where the search begins, of a deformation; of none,
// a triangle thought near, as Surface::Closest's hint.
std::optional<SurfaceFoot> FootOf(const Surface& surface, const FreeFormDeformation* deformation,
                                  const Eigen::Vector3d& point_mm, const Eigen::Vector3d& outward, double farthest_mm,
                                  const SurfaceFoot* near = nullptr);

}  // namespace sixpoint::metrology
