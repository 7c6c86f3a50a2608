// How the triangles of a surface meet: smoothly, in a crease, in a sharp edge, or not at all; and the normals there.
#pragma once

#include <absl/status/status.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "metrology/mesh/edges.h"
#include "metrology/mesh/triangle_mesh.h"
#include "metrology/nearest/nearest_triangle.h"
#include "metrology/surface/sharp_edges.h"

namespace sixpoint::metrology {

// What the border of a triangle is; bits.
enum Seam : std::uint8_t { kSmooth = 0, kCreased = 1, kSharp = 2, kOpen = 4 };

// Read by any number of threads. Part frame about the surface's middle, as the vertices are.
class Seams {
 public:
  static constexpr double kEdgeReachMm = 0.05;  // of EdgeDistance

  // The mesh and its vertices, about the middle, live longer and stay where they are.
  Seams(const TriangleMesh& mesh, const Points& vertices_mm) : mesh_(mesh), vertices_mm_(vertices_mm) {}
  // Refuses edges that more than two triangles share (with the place, from the middle on), and a closed mesh inside out.
  absl::Status Find(const Eigen::Vector3d& middle_mm);

  // Of a triangle's edge i (opposite corner i), and the triangle beyond it (NearestTriangle::kNone where it is open).
  std::uint8_t seam(std::uint32_t triangle, int edge) const { return seams_[triangle][edge]; }
  std::uint32_t beyond(std::uint32_t triangle, int edge) const { return beyond_[triangle][edge]; }
  void Prefetch(std::uint32_t triangle) const { __builtin_prefetch(&seams_[triangle]); }
  // Where the nearest point lies: smooth inside a triangle.
  std::uint8_t SeamAt(const NearestTriangle& nearest) const;
  // Angle-weighted (Baerentzen and Aanaes 2005): the side on which a query lies is that of this normal.
  Eigen::Vector3d PseudoNormal(const NearestTriangle& nearest) const;
  // Of a point of the triangle from the nearest sharp or open edge; infinite beyond kEdgeReachMm.
  double EdgeDistance(std::uint32_t triangle, const Eigen::Vector3d& point_mm) const;

  std::size_t memory_bytes() const;

 private:
  Eigen::Vector3d FacetNormal(std::uint32_t triangle) const;
  // Sums up pseudo-normals. The triangles by welded corners; those without area with all three the same.
  std::vector<TriangleCorners> SumNormals();
  std::uint8_t SeamBetween(const EdgeSide& one, const EdgeSide& other) const;
  void SetSeam(const EdgeSide* sides, std::size_t count, std::vector<SharpEdges::Edge>* sharp);
  void FindNearEdges();

  const TriangleMesh& mesh_;
  const Points& vertices_mm_;
  std::vector<std::uint32_t> welded_;            // vertex -> first vertex with the same position
  std::vector<Eigen::Vector3f> vertex_normals_;  // by welded vertex
  std::vector<std::uint8_t> vertex_seams_;       // by welded vertex: the union of its edges'
  std::vector<std::array<std::uint8_t, 3>> seams_;
  std::vector<std::array<std::uint32_t, 3>> beyond_;
  SharpEdges sharp_;                     // and open ones
  std::vector<std::uint8_t> near_edge_;  // a triangle that may reach within kEdgeReachMm of one of them
};

}  // namespace sixpoint::metrology
