// Closest points on a part's surface: prepared once, then read by any number of threads.
//
// The nearest triangle is found exactly (double precision, coordinates centred, so that CAD far from its origin loses nothing).
// Signs come from angle-weighted pseudo-normals (Baerentzen and Aanaes 2005) and are right at edges, corners and thin trailing
// edges. Where the mesh carries the true surface's corner normals, each triangle is a cubic height field that meets its three
// corners with those normals (as PN triangles, Vlachos et al. 2001), which takes the tessellation's chordal error away; sharp
// edges between faces stay sharp.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

// Where on the surface a closest point lies.
enum class SurfaceFeature : std::uint8_t {
  kFace,    // inside a face of the part: the surface is smooth there
  kEdge,    // on a sharp edge or corner
  kBorder,  // on the rim of an open surface: the query may be beyond its end
};

struct SurfacePoint {
  Eigen::Vector3d point_mm;       // part frame
  Eigen::Vector3d normal;         // outward unit normal of the surface there
  double signed_distance_mm = 0;  // of the query point; positive outside
  std::uint32_t triangle = 0;
  SurfaceFeature feature = SurfaceFeature::kFace;
  // Of the point from the nearest sharp edge or rim, whatever triangle that belongs to; infinite beyond kEdgeReachMm. A noisy
  // point that crosses an edge finds the face beyond it, with a normal that it does not deserve.
  double edge_distance_mm = std::numeric_limits<double>::infinity();
};

class Surface {
  struct Parts;

 public:
  static constexpr std::uint32_t kNoTriangle = 0xffffffff;
  static constexpr double kEdgeReachMm = 0.05;  // of SurfacePoint::edge_distance_mm

  // INVALID_ARGUMENT for a mesh without triangles, with indices or coordinates out of range, degenerate throughout, with an
  // edge that more than two triangles share, or closed and inside out. Sheets with open rims are surfaces too (kBorder).
  static absl::StatusOr<std::shared_ptr<const Surface>> Prepare(TriangleMesh mesh);
  ~Surface();

  // Nearest surface point. Ties are broken by triangle index, so results do not depend on threads. A hint (a triangle
  // thought near, such as the neighbouring point's) changes the time, never the result. A query that is not finite has
  // the distance NaN.
  SurfacePoint Closest(const Eigen::Vector3d& point_mm, std::uint32_t hint = kNoTriangle) const;
  // The same, searching only within a distance; signed_distance_mm is NaN when there is none.
  SurfacePoint ClosestWithin(const Eigen::Vector3d& point_mm, double limit_mm, std::uint32_t hint = kNoTriangle) const;

  // Whether the straight line between the two meets the flat triangles. One that begins on the surface meets it there.
  bool Meets(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm) const;

  // Makes ready for very many points near the surface (once, two seconds of two threads for a million triangles): what follows is as
  // before, but Batch and SignedDistances get several times as fast. Thread-safe.
  void PrepareNear(int thread_count) const;

  // Many points at a time, those of one cell of space together: ClosestWithin of each, to the bit, in less time. The order
  // in which they are visited depends on nothing but the points, the surface and whether it is prepared near.
  class Batch {
   public:
    // Puts the points with these indices, the same whenever they are asked for; by any thread.
    using PointsAt = std::function<void(const std::uint32_t* indices, std::size_t count, Eigen::Vector3d* points_mm)>;
    // Indices jump: whoever puts points is best to fetch them this early.
    static constexpr std::size_t kPointsAhead = 24;
    Batch(const Surface& surface, std::uint32_t count, PointsAt points_at, double limit_mm, int thread_count);
    ~Batch();
    // Those at [from, to) of the order: the point's index and what was found. For any number of threads.
    void Visit(std::size_t from, std::size_t to,
               const std::function<void(std::uint32_t index, const SurfacePoint& found)>& take) const;

   private:
    struct Search;
    const Parts& parts_;
    std::unique_ptr<const Search> search_;
  };

  // signed_distance_mm of ClosestWithin for each point, to the bit, in much less time where there are many: what lies in one
  // cell of space is measured together. Any order of points, any number of threads, the same bits. PrepareNear pays
  // where ten million points follow, or the same ones ten times: a part's first inspection is over sooner without.
  void SignedDistances(const Points& points_mm, double limit_mm, int thread_count,
                       std::vector<double>* distances_mm) const;

  // What it holds by now: mesh, tree, topology and, once made, the near cells.
  std::size_t memory_bytes() const;

  // How far the CAD's faces are from meeting within 1 mm of a point of the surface, at most: so far the surface may be off there, either
  // way. 0 elsewhere.
  double GapNear(const Eigen::Vector3d& point_mm) const;
  bool HasGaps() const;

  const TriangleMesh& mesh() const;
  Eigen::Vector3d minimum_mm() const;
  Eigen::Vector3d maximum_mm() const;
  // Of the surface, by area; and the root mean square distance from it.
  Eigen::Vector3d centroid_mm() const;
  double radius_of_gyration_mm() const;
  double area_mm2() const;
  std::size_t degenerate_triangle_count() const;  // of the mesh's, without area: left out

 private:
  explicit Surface(std::unique_ptr<const Parts> parts);
  std::unique_ptr<const Parts> parts_;
};

}  // namespace sixpoint::metrology
