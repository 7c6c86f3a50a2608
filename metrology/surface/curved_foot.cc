#include "metrology/surface/curved_foot.h"

#include <algorithm>
#include <limits>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Steps of a foot along the patch: where the surface's radius is near the distance (a trailing edge) they shrink slowly. The
// distance is off by the square of what is left, over the radius.
constexpr int kLeastSteps = 2, kMostSteps = 12;
constexpr double kSettledMm = 2e-5;
// Nearer than this a foot is followed over its triangle's edge: it may leave the triangle by so much (barycentric) before
// it is the next one's. Farther off it stays by its triangle.
constexpr double kCurvedMm = 0.1, kOvershoot = 0.05, kFarOvershoot = 0.25, kFarthestOvershoot = 4;
constexpr int kMostCrossings = 16;

// How far to step aside. A whole step goes too far by the distance over the surface's radius, which the step before tells
// (secant).
class Stride {
 public:
  double Next(const Vector3d& aside, bool is_near) {
    if (is_near && last_aside_.squaredNorm() > 0) {
      const double left = aside.dot(last_aside_) / last_aside_.squaredNorm();
      stride_ = std::clamp(stride_ / std::max(0.1, 1 - left), 0.05, 2.0);
    }
    last_aside_ = aside;
    return stride_;
  }

 private:
  double stride_ = 1;
  Vector3d last_aside_ = Vector3d::Zero();
};

}  // namespace

std::optional<CubicPatch> CurvedSurface::PatchOver(std::uint32_t triangle) const {
  if (mesh_.corner_normals.empty()) return std::nullopt;
  const TriangleCorners& c = mesh_.triangles[triangle];
  const auto& n = mesh_.corner_normals[triangle];
  return CubicPatch::Over({vertices_mm_[c[0]], vertices_mm_[c[1]], vertices_mm_[c[2]]},
                          {n[0].cast<double>(), n[1].cast<double>(), n[2].cast<double>()});
}

// Slides the foot along the curved surface until the query stands on its normal: into the next triangle where the edge is
// smooth (facets near to each other as slivers are may each be nearest to a point over another), not over a crease.
std::optional<CurvedFoot> CurvedSurface::FootOf(const Vector3d& query, const NearestTriangle& nearest) const {
  std::optional<CubicPatch> patch = PatchOver(nearest.triangle);
  if (!patch) return std::nullopt;
  std::uint32_t triangle = nearest.triangle;
  Vector3d barycentric = nearest.barycentric;
  const bool is_near = nearest.distance_squared < kCurvedMm * kCurvedMm;
  const int most_steps = is_near ? kMostSteps : kLeastSteps, most_crossings = is_near ? kMostCrossings : 0;
  const double overshoot = is_near ? kOvershoot : kFarOvershoot;
  double least_aside = kInfinity;
  Stride stride;
  CurvedFoot found{};
  for (int step = 0, crossings = 0;; ++step) {
    const CubicPatch::Foot at = patch->At(barycentric);
    const double along = (query - at.point_mm).dot(at.normal);
    const Vector3d aside = query - at.point_mm - along * at.normal;
    // Deeper than the surface's radius the steps grow: the foot that was nearest to settling stays.
    const bool grows = !(aside.squaredNorm() < (step > kLeastSteps ? least_aside : kInfinity));
    if (!grows) {
      found = {at.point_mm, at.normal, along};
      least_aside = aside.squaredNorm();
    }
    if (grows || step >= most_steps || (step >= kLeastSteps && least_aside < kSettledMm * kSettledMm)) return found;
    const double by = stride.Next(aside, is_near);
    Vector3d next = barycentric + by * patch->BarycentricStep(aside);
    int edge;
    if (next.minCoeff(&edge) < -overshoot && crossings < most_crossings && seams_.seam(triangle, edge) == kSmooth) {
      const std::uint32_t beyond = seams_.beyond(triangle, edge);
      if (const std::optional<CubicPatch> its = PatchOver(beyond)) {
        // No farther than some of the triangle's widths beyond it: a cubic is not to be followed into the distance.
        barycentric = its->Barycentric(at.point_mm + by * aside).cwiseMax(-kFarthestOvershoot);
        barycentric /= barycentric.sum();
        patch = its;
        triangle = beyond;
        ++crossings;
        step = -1;
        continue;
      }
    }
    for (int i = 0; i < 3; ++i) next[i] = std::max(next[i], seams_.seam(triangle, i) == kSmooth ? -overshoot : 0.0);
    barycentric = next / next.sum();
  }
}

}  // namespace sixpoint::metrology
