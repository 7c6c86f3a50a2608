// One triangle and the point of it that is nearest to a query.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>

#include "metrology/frames/pose.h"
#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

// Which part of a triangle is nearest: its inside, edge i (opposite corner i) or corner i.
enum class TrianglePart : std::uint8_t { kInside, kEdge0, kEdge1, kEdge2, kCorner0, kCorner1, kCorner2 };

// With its corners, which all in the neighbourhood share and so stay in the processor's cache.
struct IndexedTriangle {
  TriangleCorners corners;
  std::uint32_t triangle;  // index in the mesh
};

struct NearestTriangle {
  static constexpr std::uint32_t kNone = 0xffffffff;
  std::uint32_t triangle = kNone;  // index in the mesh
  double distance_squared = std::numeric_limits<double>::infinity();
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
  TrianglePart part = TrianglePart::kInside;
  const IndexedTriangle* item = nullptr;  // of the triangle
};

// The nearer one, of two as near that with the smaller index.
inline bool IsNearer(const NearestTriangle& one, const NearestTriangle& other) {
  return one.distance_squared < other.distance_squared ||
         (one.distance_squared == other.distance_squared && one.triangle < other.triangle);
}

// Replaces `best` where the triangle is nearer, or as near with a smaller index. In double precision: it alone decides.
void TakeNearer(const Points& vertices, const IndexedTriangle& item, const Eigen::Vector3d& query,
                NearestTriangle* best);

}  // namespace sixpoint::metrology
