// Places spread evenly over a surface, each for the same area of it: what a plan has to see.
//
// Frames: part. Units: mm. Pure; the same inputs give the same places.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

struct SurfaceSample {
  Eigen::Vector3d point_mm;
  Eigen::Vector3d normal;  // of its triangle, outward, unit
  std::uint32_t triangle = 0;
};

// The surface about a place, no farther than the radius, and on its side: whose normals are within 60 deg of its own.
struct SurfaceDisc {
  Eigen::Vector3d centre_mm;
  Eigen::Vector3d normal;  // unit
  double radius_mm = 0;
};

struct SurfaceSamples {
  std::vector<SurfaceSample> samples;
  double area_mm2 = 0;  // of each
};

// Of the whole mesh, about `count` of them. By the mesh's own order: one place after each such piece of area (systematic sampling), so that the
// share of places that have a property is the share of the area within about a half by the root of count.
SurfaceSamples SampleSurface(const TriangleMesh& mesh, std::size_t count);
// Of the disc alone, about `count` where it lies on a plane; where the part is smaller, so many of all of it, less those that look away.
SurfaceSamples SampleDisc(const TriangleMesh& mesh, const SurfaceDisc& disc, std::size_t count);

}  // namespace sixpoint::metrology
