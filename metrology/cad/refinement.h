// From a coarse mesh of a CAD shape to one whose distance from the true surface is measured and bounded.
//
// A kernel's own mesher aims at a deflection without keeping it, and fails at micrometres. This one only splits: an edge
// whose middle, or a triangle whose centroid, lies further from the true surface than asked is cut there, with the new
// vertex on the surface (or on the curve where faces meet, for both faces at once), until nothing is left to cut.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

// The true geometry behind the mesh, part frame.
class ShapeGeometry {
 public:
  virtual ~ShapeGeometry() = default;
  virtual Eigen::Vector3d FacePoint(std::uint16_t face, const Eigen::Vector2d& uv) const = 0;
  // Outward unit normal; zero where the parametrisation is singular.
  virtual Eigen::Vector3d FaceNormal(std::uint16_t face, const Eigen::Vector2d& uv) const = 0;
  virtual Eigen::Vector3d CurvePoint(std::uint32_t curve, double parameter) const = 0;
  // A curve in the parameters of one of the faces that it bounds.
  virtual Eigen::Vector2d CurveUv(std::uint32_t curve_on_face, double parameter) const = 0;
  // Parameters of the face's surface where it is nearest to a point that is near those given. These themselves, where nobody knows better.
  virtual Eigen::Vector2d FaceFoot(std::uint16_t, const Eigen::Vector3d&, const Eigen::Vector2d& near_uv) const {
    return near_uv;
  }
};

struct CoarseMesh {
  // A vertex as one face sees it; along a seam a face has two nodes for one vertex.
  struct Node {
    std::uint32_t vertex;
    std::uint16_t face;
    Eigen::Vector2d uv;
    // Where a whole line of parameters is one point (a sphere's pole): 0 when u is free there, 1 when v is; else -1.
    int free_parameter = -1;
  };
  // A piece of a curve between faces, and each face's edge that runs along it (nodes in the order of the parameters).
  struct Chord {
    std::uint32_t curve;
    double first, last;
  };
  struct Border {
    std::array<std::uint32_t, 2> nodes;
    std::uint32_t chord;
    std::uint32_t curve_on_face;
  };
  Points vertices_mm;
  std::vector<Node> nodes;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // of nodes, either way round
  std::vector<Chord> chords;
  std::vector<Border> borders;
};

struct RefinementOptions {
  double chordal_error_mm = 0.5e-3;
  // Of the cubic patches through corners and normals (cubic_patch.h), which the prepared surface is made of.
  double patch_error_mm = 0.04e-3;
  // Curves and faces of real CAD meet within a tolerance only. From the first figure on an edge is put onto its faces, as near to all of them
  // as it goes; what is left beyond the second is told (TriangleMesh::face_gaps_mm); an edge beyond the third is refused.
  double healed_from_mm = 1e-3, least_gap_mm = 10e-3, greatest_gap_mm = 0.1;
  // Longest side of a triangle at such an edge, for what is left to stay there.
  double gap_piece_mm = 0.5;
  std::size_t greatest_triangle_count = 4'000'000;
};

// Sets everything but `closed`. RESOURCE_EXHAUSTED: too many triangles. INVALID_ARGUMENT: gaps too wide, or an error
// that splitting does not cure.
absl::StatusOr<TriangleMesh> Refine(CoarseMesh coarse, const ShapeGeometry& shape, const RefinementOptions& options);

}  // namespace sixpoint::metrology
