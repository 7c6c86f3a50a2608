// Closest points on a part's surface: prepared once, then read by any number of threads.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <memory>

#include "metrology/frames/pose.h"
#include "metrology/surface/triangle_mesh.h"

namespace sixpoint::metrology {

struct SurfacePoint {
  Eigen::Vector3d point_mm;     // part frame
  Eigen::Vector3d normal;       // outward unit normal of the surface there
  double signed_distance_mm = 0;  // of the query point; positive outside
  std::uint32_t triangle = 0;
};

class Surface {
 public:
  // Refuses a mesh without triangles, with indices or coordinates out of range, or degenerate throughout.
  static absl::StatusOr<std::shared_ptr<const Surface>> Prepare(TriangleMesh mesh);
  ~Surface();

  // Nearest surface point. Ties are broken by triangle index, so results do not depend on threads.
  SurfacePoint Closest(const Eigen::Vector3d& point_mm) const;
  // The same, searching only within a distance; signed_distance_mm is NaN when there is none.
  SurfacePoint ClosestWithin(const Eigen::Vector3d& point_mm, double limit_mm) const;

  const TriangleMesh& mesh() const;
  Eigen::Vector3d minimum_mm() const;
  Eigen::Vector3d maximum_mm() const;

 private:
  struct Tree;
  explicit Surface(std::unique_ptr<const Tree> tree);
  std::unique_ptr<const Tree> tree_;
};

}  // namespace sixpoint::metrology
