#include "metrology/reconstruction/adapt_path.h"

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "metrology/frames/pose.h"
#include "metrology/linear_algebra/singular_values.h"
#include "metrology/reconstruction/deformed_surface.h"
#include "metrology/reconstruction/place_grid.h"
#include "metrology/reconstruction/smooth_step.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d TurnOf(const Matrix3d& jacobian, const Vector3d& normal) {
  const SingularValueDecomposition decomposed = DecomposeSingular(jacobian);
  const Matrix3d turn = decomposed.left * decomposed.right.transpose();
  const Vector3d moved = DeformedNormal(jacobian, normal);
  return Eigen::Quaterniond::FromTwoVectors(turn * normal, moved).toRotationMatrix() * turn;
}

absl::StatusOr<std::vector<AdaptedToolPoint>> AdaptPath(const DesignPlaces& design,
                                                        const std::vector<ShapeRegion>& regions,
                                                        const FreeFormDeformation& deformation,
                                                        const std::vector<ToolPoint>& path, double strip_mm) {
  if (absl::Status good = CheckRegions(regions); !good.ok()) return good;
  if (!(strip_mm >= 0.01 && strip_mm <= 50)) return Refuse("strip_mm", strip_mm, "0.01 to 50");
  PlaceGrid machined(strip_mm);
  for (const DesignPlace& place : design.places) {
    const std::size_t region = RegionAt(regions, place.point_mm, place.normal);
    if (region < regions.size() && regions[region].kind == RegionKind::kMachined)
      machined.Add(place.point_mm, place.normal);
  }
  std::vector<AdaptedToolPoint> adapted;
  std::uint32_t hint = Surface::kNoTriangle;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const std::string field = "template[" + std::to_string(i) + "]";
    const ToolPoint& tool = path[i];
    if (!tool.centre_mm.allFinite() || !(std::abs(tool.axis.norm() - 1) < 1e-6))
      return Refuse(field, "not finite, or no unit axis", "a point and a unit axis");
    const SurfacePoint contact = design.surface->Closest(tool.centre_mm, hint);
    hint = contact.triangle;
    const auto local = deformation.At(field, contact.point_mm);
    if (!local.ok()) return local.status();
    AdaptedToolPoint moved;
    moved.contact_mm = contact.point_mm;
    moved.normal = contact.normal;
    const std::size_t region = RegionAt(regions, contact.point_mm, contact.normal);
    if (region == regions.size() || regions[region].kind != RegionKind::kMachined)
      moved.part = 1 - SmoothStep(machined.Nearest(contact.point_mm, contact.normal, 0) / strip_mm);
    const Vector3d turn = VectorFromRotation(TurnOf(local->Jacobian(), contact.normal));
    const Matrix3d part_turn = RotationFromVector(moved.part * turn);
    moved.tool.centre_mm =
        contact.point_mm + moved.part * local->displacement_mm + part_turn * (tool.centre_mm - contact.point_mm);
    moved.tool.axis = (part_turn * tool.axis).normalized();
    adapted.push_back(moved);
  }
  return adapted;
}

}  // namespace sixpoint::metrology
