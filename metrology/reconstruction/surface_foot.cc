#include "metrology/reconstruction/surface_foot.h"

#include <Eigen/LU>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMostFootSteps = 12;
constexpr double kRested_mm = 1e-5;  // along the surface: the distance is off by the square of it, over a radius
constexpr double kSearchStep_mm = 0.25;

// The foot next to a place of the design: each step takes the point back into the design, as the deformation is about the last foot.
std::optional<SurfaceFoot> Next(const Surface& surface, const FreeFormDeformation* deformation,
                                const Vector3d& point_mm, SurfacePoint on) {
  SurfaceFoot foot;
  for (int step = 0; step < kMostFootSteps; ++step) {
    foot.place_mm = on.point_mm;
    foot.design_normal = foot.normal = on.normal;
    foot.triangle = on.triangle;
    foot.feature = on.feature;
    if (deformation == nullptr) {
      foot.distance_mm = on.normal.dot(point_mm - on.point_mm);
      return foot;
    }
    const auto local = deformation->LocalAt(on.point_mm);
    if (!local) return std::nullopt;
    const Matrix3d jacobian = local->Jacobian();
    const Matrix3d back = jacobian.inverse();
    foot.displacement_mm = local->displacement_mm;
    foot.normal = (back.transpose() * on.normal).normalized();
    const Vector3d from_mm = point_mm - on.point_mm - local->displacement_mm;
    foot.distance_mm = foot.normal.dot(from_mm);
    const Vector3d across_mm = from_mm - foot.distance_mm * foot.normal;
    const SurfacePoint next =
        surface.Closest(on.point_mm + back * across_mm + foot.distance_mm * on.normal, on.triangle);
    if ((next.point_mm - on.point_mm).norm() < kRested_mm) return foot;
    on = next;
  }
  return foot;  // it turns about an edge: any of the last will do
}

}  // namespace

std::optional<SurfaceFoot> FootOf(const Surface& surface, const FreeFormDeformation* deformation,
                                  const Vector3d& point_mm, const Vector3d& outward, double farthest_mm,
                                  const SurfaceFoot* near) {
  const auto good = [&](const std::optional<SurfaceFoot>& foot) {
    return foot && IsSameWall(foot->normal, outward) && std::abs(foot->distance_mm) <= farthest_mm;
  };
  const Vector3d moved_mm = near != nullptr ? near->displacement_mm : Vector3d::Zero();
  const std::uint32_t hint = near != nullptr ? near->triangle : Surface::kNoTriangle;
  const auto from = [&](double along_mm) {
    return Next(surface, deformation, point_mm, surface.Closest(point_mm - moved_mm + along_mm * outward, hint));
  };
  if (deformation != nullptr && near != nullptr) {
    SurfacePoint on;
    on.point_mm = near->place_mm;
    on.normal = near->design_normal;
    on.triangle = near->triangle;
    on.feature = near->feature;
    if (auto foot = Next(surface, deformation, point_mm, on); good(foot)) return foot;
  }
  if (auto foot = from(0); good(foot)) return foot;
  for (double along_mm = kSearchStep_mm; along_mm <= farthest_mm; along_mm += kSearchStep_mm)
    for (const double sign : {1.0, -1.0})
      if (auto foot = from(sign * along_mm); good(foot)) return foot;
  return std::nullopt;
}

}  // namespace sixpoint::metrology
