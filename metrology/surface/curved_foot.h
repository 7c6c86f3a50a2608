// The feet of points on the curved surface over a triangle and those that continue it smoothly.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "metrology/mesh/cubic_patch.h"
#include "metrology/mesh/triangle_mesh.h"
#include "metrology/nearest/nearest_triangle.h"
#include "metrology/surface/seams.h"

namespace sixpoint::metrology {

struct CurvedFoot {
  Eigen::Vector3d point_mm, normal;
  double signed_distance_mm;  // of the query along the normal
};

// Part frame about the surface's middle, as the vertices are. All live longer. Read by any number of threads.
class CurvedSurface {
 public:
  CurvedSurface(const TriangleMesh& mesh, const Points& vertices_mm, const Seams& seams)
      : mesh_(mesh), vertices_mm_(vertices_mm), seams_(seams) {}

  // Whether any triangle carries a patch: else nobody has a foot.
  bool IsCurved() const { return !mesh_.corner_normals.empty(); }
  // What a foot over the triangle is to read is on its way; of a curved surface.
  void Prefetch(std::uint32_t triangle) const {
    __builtin_prefetch(&mesh_.triangles[triangle]);
    __builtin_prefetch(&mesh_.corner_normals[triangle].front());
    __builtin_prefetch(&mesh_.corner_normals[triangle].back());
    seams_.Prefetch(triangle);
  }
  // From the nearest point of the facets on; none where the triangle carries no patch. Of a curved surface.
  std::optional<CurvedFoot> FootOf(const Eigen::Vector3d& query, const NearestTriangle& nearest) const;

 private:
  friend class FootFinder;
  class Patches;
  class Slide;
  std::optional<CubicPatch> PatchOver(std::uint32_t triangle) const;

  const TriangleMesh& mesh_;
  const Points& vertices_mm_;
  const Seams& seams_;
};

// One thread's working space: neighbours share their patches. Of a curved surface, which lives longer.
class FootFinder {
 public:
  explicit FootFinder(const CurvedSurface& surface);
  ~FootFinder();

  // CurvedSurface::FootOf each query among the indices: elsewhere, and where there is none, `feet` stays as it is. Many at a time take a
  // fraction of their time one by one.
  void Find(const Eigen::Vector3d* queries, const NearestTriangle* nearest, const std::uint32_t* indices,
            std::size_t count, std::optional<CurvedFoot>* feet);

 private:
  std::unique_ptr<CurvedSurface::Slide> slide_;
};

}  // namespace sixpoint::metrology
